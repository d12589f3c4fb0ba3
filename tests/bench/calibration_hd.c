/*
 * Board to HD pictures, the whole way: a rig is solved from a waved board, IR and HD, markers are
 * tracked with its IR cameras and looked for in the pictures of its HD cameras.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../unit/calib_wave.h"
#include "../unit/hd_spots.h"
#include "calib/rig/rig_write.h"
#include "calibration_parts.h"
#include "protocol/stage_client.h"
#include "sim/play.h"
#include "sim/render/hd_render.h"
#include "sim/world/scene_parts.h"

#define IR_COUNT 8
#define HD_COUNT 3
#define FRAMES 24
#define FRAMES_APART 7 /* HD frames between those that are looked at */
#define FIND_PX 4.0    /* from the place that the solved model says */
#define APART_PX 16.0  /* markers nearer to each other spoil each other's windows */

static const struct board BOARD = {
	.squares_x = 11, .squares_y = 8, .square_m = 0.035, .tag_part = 0.7};

struct hd_check {
	struct sim_play play;
	struct rig rig; /* solved: IR, then HD */
	struct sim_hd_renderer *renderers[HD_COUNT];
	int64_t times_ns[4];
	struct marker_set sets[4];
	double sum_px2;
	uint32_t spots, off;
};

/* As the solver's reference has them: camera 0's coordinates take the stage frame's place. */
static int load_solved(struct rig *rig, const struct waved *waved, const struct solution *solution)
{
	char dir[] = "/tmp/bench-calibration-hdXXXXXX", revision[17], path[300];
	char names[CAMERA_MAX][NAME_BYTES];
	static struct volume volume;
	static struct uncertainty uncertainty;
	struct cross_check check = {0};
	const struct rig_facts facts = {.software = "bench",
					.observations = &waved->observations,
					.solution = solution,
					.volume = &volume,
					.uncertainty = &uncertainty,
					.cross_check = &check,
					.rt_stage_ref = POSE_IDENTITY};

	if (!mkdtemp(dir) || rmdir(dir))
		return -errno;
	int err = rig_write(dir, &facts, revision, NULL);
	for (uint32_t c = 0; c < waved->camera_count; c++)
		memcpy(names[c], waved->cameras[c].name, NAME_BYTES);
	if (!err)
		err = rig_load(rig, dir, (const char(*)[NAME_BYTES])names, waved->camera_count,
			       NULL);
	for (uint32_t c = 0; c < waved->camera_count; c++) {
		snprintf(path, sizeof(path), "%s/%.*s.cameramodel", dir, NAME_BYTES - 1, names[c]);
		unlink(path);
	}
	snprintf(path, sizeof(path), "%s/rig.yaml", dir);
	unlink(path);
	rmdir(dir);
	return err;
}

static int solve_rig(struct rig *rig, uint64_t seed)
{
	const struct wave wave = {.ir_count = IR_COUNT,
				  .hd_count = HD_COUNT,
				  .pose_count = 100,
				  .board = BOARD,
				  .noise_px = 0.1,
				  .seed = seed};
	struct solution solution;
	struct waved waved;
	struct seed start;

	wave_make(&waved, &wave);
	int err = wave_solve(&waved, &solution, &start);
	if (!err) {
		err = load_solved(rig, &waved, &solution);
		seed_finish(&start);
		solution_finish(&solution);
	}
	wave_finish(&waved);
	return err;
}

static int begin(struct hd_check *check, uint64_t seed)
{
	const struct sim_options options = {.scene = "talking",
					    .seed = seed,
					    .camera_count = IR_COUNT,
					    .hd_camera_count = HD_COUNT,
					    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS};
	int err = sim_play_init(&check->play, &options, NULL);

	if (!err)
		err = solve_rig(&check->rig, seed);
	for (uint32_t c = 0; !err && c < HD_COUNT; c++)
		err = sim_hd_renderer_create(&check->renderers[c], check->play.scene, IR_COUNT + c);
	for (uint32_t c = 0; !err && c < IR_COUNT; c++)
		check->play.tracker_rig.views[c] = &check->rig.views[c];
	return err;
}

static void finish(struct hd_check *check)
{
	for (uint32_t c = 0; c < HD_COUNT; c++)
		sim_hd_renderer_destroy(check->renderers[c]);
	rig_finish(&check->rig);
	sim_play_finish(&check->play);
}

static void play_shot(struct hd_check *check, uint64_t shot)
{
	const struct blob_play blobs = {0};

	sim_play_shot_us(&check->play, &blobs, shot, 0);
	memmove(check->sets, check->sets + 1, 3 * sizeof(check->sets[0]));
	check->sets[3] = check->play.set;
	memmove(check->times_ns, check->times_ns + 1, 3 * sizeof(check->times_ns[0]));
	check->times_ns[3] = check->play.set.mid_exposure_ns;
}

/* The marker at the HD exposure of the second of the four sets, as a solver would have it. */
static bool find_marker(const struct hd_check *check, uint32_t label, int64_t at_ns,
			struct vec3 *p_m)
{
	double p[4][3], out[3];

	for (int s = 0; s < 4; s++) {
		const struct marker *marker = &check->sets[s].markers[label];

		if (marker->status != MARKER_MEASURED)
			return false;
		memcpy(p[s], &marker->p_stage_m, sizeof(p[s]));
	}
	if (stage_interpolate(check->times_ns, (const double(*)[3])p, at_ns, out))
		return false;
	*p_m = (struct vec3){out[0], out[1], out[2]};
	return true;
}

struct places {
	uint32_t count;
	double px[LABEL_MAX][2];
};

/* All that are in the picture; which of them the camera sees, the truth says: `seen`. */
static void project_all(const struct hd_check *check, uint32_t hd, int64_t at_ns,
			struct places *places, bool seen[LABEL_MAX])
{
	static struct sim_truth truth;
	double pixel[2], facing;

	scene_pose_markers(check->play.scene, (double)at_ns * 1e-9, &truth);
	places->count = 0;
	for (uint32_t label = 0; label < check->sets[1].label_count; label++) {
		struct vec3 p_m;

		if (!find_marker(check, label, at_ns, &p_m) ||
		    !view_project(&check->rig.views[IR_COUNT + hd], p_m, places->px[places->count],
				  NULL))
			continue;
		seen[places->count++] = scene_camera_sees(check->play.scene, &truth, IR_COUNT + hd,
							  label, pixel, &facing) &&
					facing > 0.5;
	}
}

static bool is_alone(const struct places *places, uint32_t index, const struct hd_picture *picture)
{
	const double *own = places->px[index];

	if (own[0] < APART_PX || own[1] < APART_PX || own[0] > picture->width_px - APART_PX ||
	    own[1] > picture->height_px - APART_PX)
		return false;
	for (uint32_t i = 0; i < places->count; i++)
		if (i != index &&
		    hypot(places->px[i][0] - own[0], places->px[i][1] - own[1]) < APART_PX)
			return false;
	return true;
}

static void look(struct hd_check *check, uint32_t hd, uint64_t shot)
{
	static struct places places;
	static bool seen[LABEL_MAX];
	struct hd_picture picture;

	project_all(check, hd, sim_scene_hd_mid_exposure_ns(check->play.scene, shot), &places,
		    seen);
	picture.pixels =
		sim_hd_render(check->renderers[hd], shot, &picture.width_px, &picture.height_px);
	for (uint32_t i = 0; i < places.count; i++) {
		double found[2];

		if (!seen[i] || !is_alone(&places, i, &picture) ||
		    !hd_spot_is_on_even_skin(&picture, places.px[i]))
			continue;
		hd_spot_centroid(&picture, places.px[i], found);
		double off_px = hypot(found[0] - places.px[i][0], found[1] - places.px[i][1]);
		check->off += !(off_px < FIND_PX);
		if (!(off_px < FIND_PX))
			continue;
		check->sum_px2 += off_px * off_px;
		check->spots++;
	}
}

int measure_hd(json_t *figures, uint64_t seed)
{
	struct hd_check *check = calloc(1, sizeof(*check));
	int err = check ? begin(check, seed) : -ENOMEM;
	uint64_t shot = 0;

	for (uint64_t frame = 1; !err && frame <= FRAMES; frame++) {
		uint64_t hd_shot = sim_scene_hd_shot(check->play.scene, FRAMES_APART * frame);

		while (shot < hd_shot + 3)
			play_shot(check, shot++);
		for (uint32_t c = 0; c < HD_COUNT; c++)
			look(check, c, hd_shot);
	}
	if (!err && !check->spots)
		err = -ENODATA;
	if (!err) {
		json_object_set_new(figures, "hd_reprojection_rms_px",
				    json_real(sqrt(check->sum_px2 / check->spots)));
		json_object_set_new(figures, "hd_reprojection_spots", json_real(check->spots));
		json_object_set_new(figures, "hd_reprojection_not_found", json_real(check->off));
	}
	if (check)
		finish(check);
	free(check);
	return err;
}
