/*
 * How long an operator waits: from the last pictures of the board to the report, and, of a
 * recording, for all of it. The way is that of stagectl calibrate cameras.
 */
#include <errno.h>
#include <ftw.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../unit/calib_wave.h"
#include "base/clock.h"
#include "calib/board/choose.h"
#include "calib/board/observations_file.h"
#include "calib/rig/rig_store.h"
#include "calibration_parts.h"
#include "ctl/calibrate/calibrate_make.h"
#include "ctl/calibrate/calibrate_search.h"
#include "sim/render/hd_render.h"
#include "sim/render/render.h"
#include "sim/world/scene_parts.h"

#define IR_COUNT 8
#define HD_COUNT 3
#define CAMERA_COUNT (IR_COUNT + HD_COUNT)
#define THREAD_COUNT 2
#define POSES 100
#define SHOTS 4 /* searched */
#define SHOT_STEP 37

static const struct board BOARD = {
	.squares_x = 11, .squares_y = 8, .square_m = 0.035, .tag_part = 0.7};

struct pictures {
	struct frame frames[SHOTS][CAMERA_COUNT]; /* pixels owned */
	struct view_search searches[CAMERA_COUNT];
	_Atomic int next; /* camera of the shot */
	int shot;
};

static int keep(struct frame *frame, const uint8_t *pixels, enum pixel_format format)
{
	size_t bytes = (size_t)frame->width_px * (size_t)frame->height_px;
	uint8_t *copy = malloc(bytes);

	if (!copy)
		return -ENOMEM;
	memcpy(copy, pixels, bytes);
	frame->pixels = copy;
	frame->stride_bytes = frame->width_px;
	frame->format = format;
	return 0;
}

static int render_ir(struct pictures *p, const struct sim_scene *scene, uint32_t camera)
{
	struct sim_renderer *renderer;
	int err = sim_renderer_create(&renderer, scene, camera, SIM_NOISE_FULL);

	for (int i = 0; !err && i < SHOTS; i++) {
		struct frame *frame = &p->frames[i][camera];
		const uint8_t *pixels = sim_render(renderer, (uint64_t)(5 + i * SHOT_STEP),
						   &frame->width_px, &frame->height_px);

		err = keep(frame, pixels, PIXEL_GREY8);
	}
	sim_renderer_destroy(renderer);
	return err;
}

static int render_hd(struct pictures *p, const struct sim_scene *scene, uint32_t camera)
{
	struct sim_hd_renderer *renderer = NULL;
	int err = sim_hd_renderer_create(&renderer, scene, camera);

	for (int i = 0; !err && i < SHOTS; i++) {
		struct frame *frame = &p->frames[i][camera];
		const uint8_t *pixels = sim_hd_render(renderer, (uint64_t)(5 + i * SHOT_STEP),
						      &frame->width_px, &frame->height_px);

		err = keep(frame, pixels, PIXEL_BAYER_RG8);
	}
	sim_hd_renderer_destroy(renderer);
	return err;
}

static int render_all(struct pictures *p, const struct sim_scene *scene)
{
	int err = 0;

	for (uint32_t c = 0; !err && c < CAMERA_COUNT; c++)
		err = c < IR_COUNT ? render_ir(p, scene, c) : render_hd(p, scene, c);
	return err;
}

static void *search_cameras(void *argument)
{
	struct pictures *p = argument;
	int camera;

	while ((camera = p->next++) < CAMERA_COUNT)
		if (view_search_run(&p->searches[camera], &p->frames[p->shot][camera]))
			return argument;
	return NULL;
}

static int search_shot(struct pictures *p, int shot)
{
	pthread_t threads[THREAD_COUNT];
	void *failed;
	int err = 0, count = 0;

	p->next = 0;
	p->shot = shot;
	while (!err && count < THREAD_COUNT) {
		err = -pthread_create(&threads[count], NULL, search_cameras, p);
		count += !err;
	}
	while (count-- > 0) {
		pthread_join(threads[count], &failed);
		err = failed ? -ENOMEM : err;
	}
	return err;
}

/* Seconds of a shot's pictures. */
static int time_search(struct pictures *p, const struct board *board, bool thorough,
		       double *seconds)
{
	const struct view_search_settings settings = {.blur_max_px = 2, .thorough = thorough};
	int err = 0;

	for (uint32_t c = 0; !err && c < CAMERA_COUNT; c++)
		err = view_search_init(&p->searches[c], c, board, &settings);
	int64_t start_ns = clock_now_ns();
	for (int i = 0; !err && i < SHOTS; i++)
		err = search_shot(p, i);
	*seconds = (double)(clock_now_ns() - start_ns) * 1e-9 / SHOTS;
	for (uint32_t c = 0; c < CAMERA_COUNT; c++)
		view_search_finish(&p->searches[c]);
	return err;
}

/* Of one shot: as live search has it, and as a recording is searched. */
static int time_pictures(double *live_s, double *recorded_s)
{
	const struct sim_options options = {
		.scene = "board", .seed = 3, .camera_count = IR_COUNT, .hd_camera_count = HD_COUNT};
	struct pictures *p = calloc(1, sizeof(*p));
	struct sim_scene *scene = NULL;
	int err = p ? sim_scene_create(&scene, &options, NULL) : -ENOMEM;

	if (!err)
		err = render_all(p, scene);
	if (!err)
		err = time_search(p, &scene->board.print, false, live_s);
	if (!err)
		err = time_search(p, &scene->board.print, true, recorded_s);
	for (int i = 0; p && i < SHOTS * CAMERA_COUNT; i++)
		free((void *)p->frames[i / CAMERA_COUNT][i % CAMERA_COUNT].pixels);
	sim_scene_destroy(scene);
	free(p);
	return err;
}

/* What comes behind the last picture's corners: choosing, keeping, and all of the verb's making. */
static int make_rig(const char *dir, const struct observations *all)
{
	const struct choose_settings settings = CHOOSE_SETTINGS_DEFAULT;
	const struct calibration calibration = calibration_default();
	struct camera_coverage coverage[CAMERA_MAX];
	struct calibrate_making *k = calloc(1, sizeof(*k));
	struct observations chosen = {0};
	char rig[64], kept[64];
	uint32_t near_count;
	int err = k ? observations_choose(&chosen, all, &settings, &near_count) : -ENOMEM;

	snprintf(rig, sizeof(rig), "%s/rig", dir);
	snprintf(kept, sizeof(kept), "%s/corners.vnl", dir);
	if (!err)
		err = coverage_find(coverage, &chosen);
	if (!err)
		err = observations_write(&chosen, kept, NULL);
	if (!err) {
		k->rig_dir = rig;
		k->kept_path = kept;
		k->lens = SOLVE_LENS_DEFAULT;
		k->calibration = &calibration;
		k->observations = &chosen;
		k->coverage = coverage;
		err = rig_store_path(k->revision_dir, rig, NULL, true, NULL);
	}
	if (!err)
		err = calibrate_make(k, NULL);
	if (!err && !k->verdict.passed)
		err = -EDOM;
	if (k)
		calibrate_making_finish(k);
	free(k);
	observations_finish(&chosen);
	return err;
}

static int remove_entry(const char *path, const struct stat *st, int kind, struct FTW *where)
{
	(void)st;
	(void)kind;
	(void)where;
	return remove(path);
}

static int time_making(uint64_t seed, double *seconds)
{
	const struct wave wave = {.ir_count = IR_COUNT,
				  .hd_count = HD_COUNT,
				  .pose_count = POSES,
				  .board = BOARD,
				  .noise_px = 0.1,
				  .seed = seed};
	char dir[] = "/tmp/bench-calibration-rigXXXXXX";
	struct waved waved;

	if (!mkdtemp(dir))
		return -errno;
	wave_make(&waved, &wave);
	int64_t start_ns = clock_now_ns();
	int err = make_rig(dir, &waved.observations);
	*seconds = (double)(clock_now_ns() - start_ns) * 1e-9;
	wave_finish(&waved);
	nftw(dir, remove_entry, 8, FTW_DEPTH | FTW_PHYS);
	return err;
}

int measure_time(json_t *figures, uint64_t seed)
{
	double live_s = 0, recorded_s = 0, making_s = 0;
	int err = time_pictures(&live_s, &recorded_s);

	if (!err)
		err = time_making(seed, &making_s);
	if (err)
		return err;
	json_object_set_new(figures, "wall_s", json_real(live_s + making_s));
	json_object_set_new(figures, "last_pictures_s", json_real(live_s));
	json_object_set_new(figures, "recording_wall_s", json_real(POSES * recorded_s + making_s));
	return 0;
}
