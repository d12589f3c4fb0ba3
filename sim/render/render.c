/*
 * Draws what one camera sees of a scene: a spot for every visible marker and ghost, the lamps that
 * shine into it, and a few hot pixels.
 */
#include "sim/render/render.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/board/board_picture.h"
#include "sim/render/canvas.h"
#include "sim/render/lamps.h"
#include "sim/render/marker_spot.h"
#include "sim/render/optics.h"
#include "sim/world/scene_parts.h"

#define STRIP_FRAMES 8
#define HOT_PIXELS 4
#define PAPER_GREY 150 /* of a calibration board that faces the camera at its range */

struct hot_pixel {
	int x, y;
	float grey;
};

struct sim_renderer {
	/* set when made */
	const struct sim_scene *scene; /* borrowed */
	uint32_t camera;
	double brightness;           /* of a nominal marker facing the camera at its range */
	struct board_picture *board; /* owned; NULL: there is none */
	struct hot_pixel hot[HOT_PIXELS];
	/* owned by the thread that renders */
	struct optics optics;
	struct canvas canvas;
	struct sim_truth truth;
};

static void set_hot_pixels(struct sim_renderer *renderer, struct rng *rng)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];

	for (int i = 0; i < HOT_PIXELS; i++) {
		renderer->hot[i].x = (int)(rng_uniform(rng) * camera->width_px);
		renderer->hot[i].y = (int)(rng_uniform(rng) * camera->height_px);
		renderer->hot[i].grey = (float)(30.0 + 150.0 * rng_uniform(rng));
	}
}

static int make_board(struct sim_renderer *renderer, double blur_sigma_px)
{
	const struct board_paper paper = {
		.grey = {{PAPER_GREY, PAPER_GREY}, {PAPER_GREY, PAPER_GREY}}};

	if (!renderer->scene->script.board)
		return 0;
	return board_picture_create(&renderer->board, renderer->scene, renderer->camera,
				    blur_sigma_px, &paper);
}

/* A board covers much of the image: pre-made noise would not help. */
static int make_canvas(struct sim_renderer *renderer, enum sim_noise noise, struct rng *rng)
{
	const struct sim_script *script = &renderer->scene->script;
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	struct canvas_plan plan = {
		.width_px = camera->width_px,
		.height_px = camera->height_px,
		.frame_count = noise == SIM_NOISE_FAST && !script->board ? STRIP_FRAMES : 1,
		.optics = script->optics,
		.black_grey = 8.0 + 4.0 * rng_uniform(rng),
		.ambient_grey = script->ambient_grey};

	return canvas_init(&renderer->canvas, &plan, rng);
}

static int set_camera(struct sim_renderer *renderer, enum sim_noise noise, struct rng *rng)
{
	const struct sim_scene *scene = renderer->scene;
	const struct sim_camera *camera = &scene->cameras[renderer->camera];
	double share = optics_share(scene->seed, renderer->camera),
	       sigma_px = optics_sigma_px(scene->script.optics, share);
	int err = optics_init(&renderer->optics, scene->script.optics, share, camera->width_px,
			      camera->height_px);

	if (err)
		return err;
	renderer->brightness =
		marker_brightness(scene, renderer->camera, MARKER_PEAK_GREY, sigma_px);
	set_hot_pixels(renderer, rng);
	err = make_board(renderer, sigma_px);
	return err ? err : make_canvas(renderer, noise, rng);
}

int sim_renderer_create(struct sim_renderer **out, const struct sim_scene *scene, uint32_t camera,
			enum sim_noise noise)
{
	struct sim_renderer *renderer = calloc(1, sizeof(*renderer));
	struct rng rng;

	if (!renderer)
		return -ENOMEM;
	renderer->scene = scene;
	renderer->camera = camera;
	rng_init(&rng, scene->seed, 16 + camera);
	if (set_camera(renderer, noise, &rng) != 0) {
		sim_renderer_destroy(renderer);
		return -ENOMEM;
	}
	*out = renderer;
	return 0;
}

void sim_renderer_destroy(struct sim_renderer *renderer)
{
	if (!renderer)
		return;
	optics_finish(&renderer->optics);
	canvas_finish(&renderer->canvas);
	board_picture_destroy(renderer->board);
	free(renderer);
}

static void add_spot(struct sim_renderer *renderer, const struct spot *spot)
{
	struct canvas *canvas = &renderer->canvas;
	struct pixel_window window = optics_window(&renderer->optics, spot);
	float *light = canvas_add_window(canvas, window);

	if (light)
		optics_fill(&renderer->optics, spot, &window, light);
}

static void add_markers(struct sim_renderer *renderer)
{
	double pixel[2], facing;

	for (uint32_t m = 0; m < renderer->truth.marker_count; m++) {
		if (!scene_camera_sees(renderer->scene, &renderer->truth, renderer->camera, m,
				       pixel, &facing))
			continue;
		struct spot spot = marker_spot(renderer->scene, &renderer->truth, renderer->camera,
					       m, pixel, facing, renderer->brightness);

		add_spot(renderer, &spot);
	}
}

static void add_ghosts(struct sim_renderer *renderer)
{
	for (uint32_t g = 0; g < renderer->truth.ghost_count; g++) {
		double pixel[2], value;
		struct vec3 place;
		struct spot spot;

		if (scene_camera_sees_ghost(renderer->scene, &renderer->truth, renderer->camera, g,
					    &place, pixel, &value) &&
		    ghost_spot(renderer->scene, &renderer->truth, renderer->camera, place, value,
			       renderer->brightness, &spot))
			add_spot(renderer, &spot);
	}
}

static void add_lamps(struct sim_renderer *renderer, bool strobes_lit)
{
	struct spot lamps[LAMP_MAX];
	uint32_t count =
		lamps_find(renderer->scene, &renderer->truth, renderer->camera, strobes_lit, lamps);

	for (uint32_t i = 0; i < count; i++)
		add_spot(renderer, &lamps[i]);
}

static void add_hot_pixels(struct sim_renderer *renderer)
{
	for (int i = 0; i < HOT_PIXELS; i++) {
		const struct hot_pixel *hot = &renderer->hot[i];
		float *light = canvas_add_window(
			&renderer->canvas,
			(struct pixel_window){hot->x, hot->y, hot->x + 1, hot->y + 1});

		if (light)
			*light = hot->grey;
	}
}

/* `lit`: its own strobe; `strobes_lit`: those of the others. */
static const uint8_t *render(struct sim_renderer *renderer, uint64_t shot, bool lit,
			     bool strobes_lit, int *width_px, int *height_px)
{
	double time_s = (double)sim_scene_mid_exposure_ns(renderer->scene, shot) * 1e-9;
	struct rng rng;

	rng_init(&rng, renderer->scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15),
		 64 + renderer->camera);
	scene_pose_markers(renderer->scene, time_s, &renderer->truth);
	canvas_clear(&renderer->canvas, &rng);
	if (lit && renderer->board)
		board_picture_draw(renderer->board, shot, &renderer->canvas.sensor, &rng,
				   renderer->canvas.image);
	if (lit) {
		add_markers(renderer);
		add_ghosts(renderer);
	}
	add_lamps(renderer, strobes_lit);
	add_hot_pixels(renderer);
	*width_px = renderer->canvas.width_px;
	*height_px = renderer->canvas.height_px;
	return canvas_expose(&renderer->canvas, &rng);
}

const uint8_t *sim_render(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			  int *height_px)
{
	return render(renderer, shot, true, true, width_px, height_px);
}

const uint8_t *sim_render_unlit(struct sim_renderer *renderer, uint64_t shot, int *width_px,
				int *height_px)
{
	return render(renderer, shot, false, true, width_px, height_px);
}

const uint8_t *sim_render_dark(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			       int *height_px)
{
	return render(renderer, shot, false, false, width_px, height_px);
}
