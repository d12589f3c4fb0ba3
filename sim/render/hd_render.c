/*
 * One image is kept: what was drawn into it is put back from a pre-made background before the next
 * shot is drawn, so that a frame costs what the head covers, not what the sensor has.
 */
#include "sim/render/hd_render.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/board/board_picture.h"
#include "sim/render/hd_figures.h"
#include "sim/render/marker_spot.h"
#include "sim/render/noise.h"

#define PEAK_GREY 330.0   /* of a nominal marker in the ring's light: beyond white */
#define BLUR_SIGMA_PX 1.3 /* of lens and low-pass filter */
#define BACKGROUND_GREY 20.0

struct sim_hd_renderer {
	/* set when made */
	const struct sim_scene *scene; /* borrowed */
	uint32_t camera;
	struct blur blur;
	double brightness;
	struct noise *noise;         /* owned; of light alone, without a background of its own */
	uint8_t *background, *image; /* owned */
	int8_t grain[HD_GRAIN + HD_GRAIN_MORE];
	struct hd_figures *figures;  /* owned */
	struct board_picture *board; /* owned; NULL: there is none */
	/* owned by the thread that renders */
	struct sim_rolling rolling;
	uint32_t drawn_count;
	struct pixel_window drawn[LABEL_MAX + HD_FIGURE_MAX]; /* what differs from the background */
	float light[SPOT_WINDOW_MAX * SPOT_WINDOW_MAX];
};

static size_t pixel_count(const struct sim_hd_renderer *renderer)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];

	return (size_t)camera->width_px * (size_t)camera->height_px;
}

/* A room that is dark, a little lighter in the middle. */
static void fill_background(struct sim_hd_renderer *renderer, struct rng *rng)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	int width = camera->width_px, height = camera->height_px;
	uint8_t *out = renderer->background;

	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++) {
			float u = (float)x / (float)width - 0.5f;
			float v = (float)y / (float)height - 0.5f;
			float grey = (float)BACKGROUND_GREY * (1 - 2 * (u * u + v * v));
			int noisy = (int)grey + renderer->grain[rng_u32(rng) % HD_GRAIN];

			*out++ = (uint8_t)(noisy < 0 ? 0 : noisy);
		}
	memcpy(renderer->image, renderer->background, pixel_count(renderer));
}

/* Bounded so that the darkest texel stays above 0. */
static void fill_grain(struct sim_hd_renderer *renderer, struct rng *rng)
{
	for (int i = 0; i < HD_GRAIN + HD_GRAIN_MORE; i++) {
		float value = 2.0f * renderer->noise->normals[rng_u32(rng) % NORMAL_COUNT];

		renderer->grain[i] = (int8_t)fminf(fmaxf(roundf(value), -8), 8);
	}
}

static void fill(struct sim_hd_renderer *renderer)
{
	struct rng rng;

	rng_init(&rng, renderer->scene->seed, 16 + renderer->camera);
	blur_init(&renderer->blur, BLUR_SIGMA_PX);
	renderer->brightness =
		marker_brightness(renderer->scene, renderer->camera, PEAK_GREY, BLUR_SIGMA_PX);
	fill_grain(renderer, &rng);
	fill_background(renderer, &rng);
}

/* White paper in warm light. */
static int add_board(struct sim_hd_renderer *renderer)
{
	const struct board_paper paper = {.grey = {{170, 150}, {150, 120}}, .covers = true};

	return board_picture_create(&renderer->board, renderer->scene, renderer->camera,
				    BLUR_SIGMA_PX, &paper);
}

int sim_hd_renderer_create(struct sim_hd_renderer **out, const struct sim_scene *scene,
			   uint32_t camera)
{
	struct sim_hd_renderer *renderer = calloc(1, sizeof(*renderer));

	if (!renderer)
		return -ENOMEM;
	renderer->scene = scene;
	renderer->camera = camera;
	renderer->background = malloc(pixel_count(renderer));
	renderer->image = malloc(pixel_count(renderer));
	if (!renderer->background || !renderer->image || noise_create(&renderer->noise, 0) != 0 ||
	    hd_figures_create(&renderer->figures, scene) != 0 ||
	    (scene->script.board && add_board(renderer) != 0)) {
		sim_hd_renderer_destroy(renderer);
		return -ENOMEM;
	}
	fill(renderer);
	*out = renderer;
	return 0;
}

void sim_hd_renderer_destroy(struct sim_hd_renderer *renderer)
{
	if (!renderer)
		return;
	noise_destroy(renderer->noise);
	board_picture_destroy(renderer->board);
	hd_figures_destroy(renderer->figures);
	free(renderer->background);
	free(renderer->image);
	free(renderer);
}

static void put_back(struct sim_hd_renderer *renderer)
{
	int width = renderer->scene->cameras[renderer->camera].width_px;

	for (uint32_t i = 0; i < renderer->drawn_count; i++) {
		const struct pixel_window *w = &renderer->drawn[i];

		for (int y = w->y0; y < w->y1; y++) {
			size_t at = (size_t)y * (size_t)width + (size_t)w->x0;

			memcpy(renderer->image + at, renderer->background + at,
			       (size_t)(w->x1 - w->x0));
		}
	}
	renderer->drawn_count = 0;
}

static void draw_figures(struct sim_hd_renderer *renderer, const struct sim_camera *camera,
			 struct rng *rng)
{
	struct hd_canvas canvas = {renderer->image, camera->width_px, renderer->grain,
				   rng_u32(rng)};

	renderer->drawn_count += hd_figures_draw(renderer->figures, &renderer->rolling, camera,
						 &canvas, &renderer->drawn[renderer->drawn_count]);
}

/* The spot's light comes on top of what is there, with the noise of both. */
static void add_light(struct sim_hd_renderer *renderer, const struct pixel_window *w,
		      struct rng *rng)
{
	size_t width = (size_t)renderer->scene->cameras[renderer->camera].width_px;
	size_t count = (size_t)(w->x1 - w->x0);
	float *light = renderer->light;

	for (int y = w->y0; y < w->y1; y++, light += count) {
		uint8_t *row = renderer->image + (size_t)y * width + (size_t)w->x0;

		for (size_t x = 0; x < count; x++)
			light[x] += row[x];
		noise_expose(renderer->noise, rng, light, row, count);
	}
}

static void draw_markers(struct sim_hd_renderer *renderer, struct rng *rng)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	struct sim_truth *truth = &renderer->rolling.at[1];
	double facing;

	for (uint32_t m = 0; m < truth->marker_count; m++) {
		struct sim_sight sight = sim_rolling_sight(&renderer->rolling, renderer->scene,
							   renderer->camera, m, &facing);

		if (!sight.seen)
			continue;
		struct spot spot = marker_spot(renderer->scene, truth, renderer->camera, m,
					       sight.pixel, facing, renderer->brightness);
		struct pixel_window window =
			spot_window(&spot, &renderer->blur, camera->width_px, camera->height_px);

		spot_fill(&spot, &renderer->blur, &window, renderer->light);
		add_light(renderer, &window, rng);
		renderer->drawn[renderer->drawn_count++] = window;
	}
}

const uint8_t *sim_hd_render(struct sim_hd_renderer *renderer, uint64_t shot, int *width_px,
			     int *height_px)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	const struct sensor sensor = {.even = renderer->noise};
	struct rng rng;

	rng_init(&rng, renderer->scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15),
		 64 + renderer->camera);
	sim_rolling_init(&renderer->rolling, renderer->scene, renderer->camera, shot);
	put_back(renderer);
	if (renderer->board) {
		renderer->drawn[renderer->drawn_count++] =
			board_picture_draw(renderer->board, shot, &sensor, &rng, renderer->image);
	} else {
		draw_figures(renderer,
			     scene_camera_at(renderer->scene, renderer->camera,
					     renderer->rolling.at[1].time_s),
			     &rng);
		draw_markers(renderer, &rng);
	}
	*width_px = camera->width_px;
	*height_px = camera->height_px;
	return renderer->image;
}
