/*
 * Draws what one camera sees of a scene: a spot for every visible marker, and a few hot pixels.
 */
#include "sim/render.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/board_picture.h"
#include "sim/canvas.h"
#include "sim/marker_spot.h"
#include "sim/scene_parts.h"
#include "sim/spot.h"

#define STRIP_FRAMES 8
#define HOT_PIXELS 4
#define PAPER_GREY 150  /* of a calibration board that faces the camera at its range */
#define PEAK_GREY 175.0 /* a nominal face marker, facing the camera at its range */

struct hot_pixel {
	int x, y;
	float grey;
};

struct sim_renderer {
	/* set when made */
	const struct sim_scene *scene; /* borrowed */
	uint32_t camera;
	struct blur blur;
	double brightness; /* of a nominal marker facing the camera at its range */
	struct hot_pixel hot[HOT_PIXELS];
	struct board_picture *board; /* owned; NULL: there is none */
	/* owned by the thread that renders */
	struct canvas canvas;
	struct sim_truth truth;
};

static void set_camera(struct sim_renderer *renderer, struct rng *rng)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];

	blur_init(&renderer->blur, 0.8 + 0.2 * rng_uniform(rng));
	renderer->brightness = marker_brightness(camera, PEAK_GREY, renderer->blur.sigma_px);
	for (int i = 0; i < HOT_PIXELS; i++) {
		renderer->hot[i].x = (int)(rng_uniform(rng) * camera->width_px);
		renderer->hot[i].y = (int)(rng_uniform(rng) * camera->height_px);
		renderer->hot[i].grey = (float)(30.0 + 150.0 * rng_uniform(rng));
	}
}

static int add_board(struct sim_renderer *renderer)
{
	const struct board_paper paper = {
		.grey = {{PAPER_GREY, PAPER_GREY}, {PAPER_GREY, PAPER_GREY}}};

	return board_picture_create(&renderer->board, renderer->scene, renderer->camera,
				    renderer->blur.sigma_px, &paper);
}

int sim_renderer_create(struct sim_renderer **out, const struct sim_scene *scene, uint32_t camera,
			enum sim_noise noise)
{
	struct sim_renderer *renderer = calloc(1, sizeof(*renderer));
	const struct sim_camera *model = &scene->cameras[camera];
	struct rng rng;

	if (!renderer)
		return -ENOMEM;
	renderer->scene = scene;
	renderer->camera = camera;
	rng_init(&rng, scene->seed, 16 + camera);
	set_camera(renderer, &rng);
	uint32_t frames = noise == SIM_NOISE_FAST && !scene->script.board ? STRIP_FRAMES : 1;

	if (canvas_init(&renderer->canvas, model->width_px, model->height_px, frames,
			8.0 + 4.0 * rng_uniform(&rng), &rng) != 0 ||
	    (scene->script.board && add_board(renderer) != 0)) {
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
	canvas_finish(&renderer->canvas);
	board_picture_destroy(renderer->board);
	free(renderer);
}

static void add_spots(struct sim_renderer *renderer)
{
	struct canvas *canvas = &renderer->canvas;
	double pixel[2], facing;

	for (uint32_t m = 0; m < renderer->truth.marker_count; m++) {
		if (!scene_camera_sees(renderer->scene, &renderer->truth, renderer->camera, m,
				       pixel, &facing))
			continue;
		struct spot spot = marker_spot(renderer->scene, &renderer->truth, renderer->camera,
					       m, pixel, facing, renderer->brightness);
		struct pixel_window window =
			spot_window(&spot, &renderer->blur, canvas->width_px, canvas->height_px);
		float *light = canvas_add_window(canvas, window);

		if (light)
			spot_fill(&spot, &renderer->blur, &window, light);
	}
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

const uint8_t *sim_render(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			  int *height_px)
{
	double time_s = (double)sim_scene_mid_exposure_ns(renderer->scene, shot) * 1e-9;
	struct rng rng;

	rng_init(&rng, renderer->scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15),
		 64 + renderer->camera);
	scene_pose_markers(renderer->scene, time_s, &renderer->truth);
	canvas_clear(&renderer->canvas, &rng);
	if (renderer->board) /* its canvas is filled anew every time */
		board_picture_draw(renderer->board, shot, renderer->canvas.noise, &rng,
				   renderer->canvas.image);
	add_spots(renderer);
	add_hot_pixels(renderer);
	*width_px = renderer->canvas.width_px;
	*height_px = renderer->canvas.height_px;
	return canvas_expose(&renderer->canvas, &rng);
}
