/*
 * With pre-made noise the picture is a stretch of a long strip of noise that starts anywhere; the
 * windows drawn over it are put back before the next picture, so that no frame is ever copied.
 */
#include "sim/render/canvas.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static size_t pixel_count(const struct canvas *canvas)
{
	return (size_t)canvas->width_px * (size_t)canvas->height_px;
}

/* Memory that has been touched: the thread that draws shall meet no page fault. */
static void *zeroed(size_t bytes)
{
	void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);

	return memory ? memset(memory, 0, bytes) : NULL;
}

static int make_noise(struct canvas *canvas, const struct canvas_plan *plan, struct rng *rng)
{
	if (plan->optics == SIM_OPTICS_TAILED)
		return patterned_noise_create(&canvas->sensor.patterned, plan->width_px,
					      plan->height_px, plan->black_grey, plan->ambient_grey,
					      rng);
	return noise_create(&canvas->sensor.even, plan->black_grey + plan->ambient_grey);
}

/* Fresh noise in frame `frame` of the strip. */
static void fill_frame(struct canvas *canvas, uint32_t frame, struct rng *rng)
{
	uint8_t *pixels = canvas->strip + frame * pixel_count(canvas);
	int16_t *rows = canvas->rows + frame * (size_t)canvas->height_px;

	if (canvas->sensor.patterned) {
		patterned_noise_fill_rows(canvas->sensor.patterned, rng, rows);
		patterned_noise_fill(canvas->sensor.patterned, rng, rows, pixels);
	} else {
		noise_fill_background(canvas->sensor.even, rng, pixels, pixel_count(canvas));
	}
}

int canvas_init(struct canvas *canvas, const struct canvas_plan *plan, struct rng *rng)
{
	memset(canvas, 0, sizeof(*canvas));
	canvas->width_px = plan->width_px;
	canvas->height_px = plan->height_px;
	canvas->frame_count = plan->frame_count;
	canvas->strip = zeroed(plan->frame_count * pixel_count(canvas));
	canvas->rows = zeroed(plan->frame_count * (size_t)plan->height_px * sizeof(int16_t));
	canvas->light = zeroed(CANVAS_LIGHT_MAX * sizeof(*canvas->light));
	canvas->before = zeroed(CANVAS_LIGHT_MAX);
	if (!canvas->strip || !canvas->rows || !canvas->light || !canvas->before ||
	    make_noise(canvas, plan, rng) != 0) {
		canvas_finish(canvas);
		return -ENOMEM;
	}
	canvas->image = canvas->strip;
	canvas->sensor.rows = canvas->rows;
	for (uint32_t frame = 0; frame < plan->frame_count; frame++)
		fill_frame(canvas, frame, rng);
	return 0;
}

void canvas_finish(struct canvas *canvas)
{
	noise_destroy(canvas->sensor.even);
	patterned_noise_destroy(canvas->sensor.patterned);
	free(canvas->strip);
	free(canvas->rows);
	free(canvas->light);
	free(canvas->before);
	memset(canvas, 0, sizeof(*canvas));
}

static uint8_t *image_row(const struct canvas *canvas, int x, int y)
{
	return canvas->image + (size_t)y * (size_t)canvas->width_px + (size_t)x;
}

/* Undoes expose_window() of all, the last drawn first. */
static void put_back(struct canvas *canvas)
{
	for (uint32_t i = 0; i < canvas->window_count; i++) {
		const struct pixel_window *w = &canvas->windows[i].at;
		const uint8_t *before = canvas->before + canvas->windows[i].first;
		size_t width = (size_t)(w->x1 - w->x0);

		for (int y = w->y0; y < w->y1; y++, before += width)
			memcpy(image_row(canvas, w->x0, y), before, width);
	}
}

/* A stretch of even noise may start anywhere; patterned noise stays where it is. */
static void move_image(struct canvas *canvas, struct rng *rng)
{
	double lines = (double)(canvas->frame_count - 1) * (double)pixel_count(canvas) / 64;
	uint32_t frame = (uint32_t)(rng_uniform(rng) * canvas->frame_count);

	if (canvas->sensor.patterned) {
		canvas->image = canvas->strip + frame * pixel_count(canvas);
		canvas->sensor.rows = canvas->rows + frame * (size_t)canvas->height_px;
	} else {
		canvas->image = canvas->strip + 64 * (size_t)(rng_uniform(rng) * lines);
	}
}

void canvas_clear(struct canvas *canvas, struct rng *rng)
{
	if (canvas->frame_count == 1) {
		fill_frame(canvas, 0, rng);
	} else {
		put_back(canvas);
		move_image(canvas, rng);
	}
	canvas->window_count = 0;
	canvas->light_count = 0;
}

float *canvas_add_window(struct canvas *canvas, struct pixel_window window)
{
	int count = pixel_window_count(&window);

	if (count == 0 || canvas->light_count + (uint32_t)count > CANVAS_LIGHT_MAX ||
	    canvas->window_count == CANVAS_WINDOWS)
		return NULL;
	float *light = canvas->light + canvas->light_count;

	canvas->windows[canvas->window_count].at = window;
	canvas->windows[canvas->window_count++].first = canvas->light_count;
	canvas->light_count += (uint32_t)count;
	return light;
}

/* Moves the light of window `from` to window `to` where they overlap. */
static void move_light(struct canvas *canvas, uint32_t to, uint32_t from)
{
	const struct pixel_window *a = &canvas->windows[to].at, *b = &canvas->windows[from].at;
	int x0 = a->x0 > b->x0 ? a->x0 : b->x0, x1 = a->x1 < b->x1 ? a->x1 : b->x1;
	int y0 = a->y0 > b->y0 ? a->y0 : b->y0, y1 = a->y1 < b->y1 ? a->y1 : b->y1;
	float *to_light = canvas->light + canvas->windows[to].first;
	float *from_light = canvas->light + canvas->windows[from].first;

	for (int y = y0; y < y1; y++)
		for (int x = x0; x < x1; x++) {
			float *source = &from_light[(y - b->y0) * (b->x1 - b->x0) + x - b->x0];

			to_light[(y - a->y0) * (a->x1 - a->x0) + x - a->x0] += *source;
			*source = 0;
		}
}

static void expose_window(struct canvas *canvas, uint32_t i, struct rng *rng)
{
	const struct pixel_window *w = &canvas->windows[i].at;
	const float *light = canvas->light + canvas->windows[i].first;
	uint8_t *before = canvas->before + canvas->windows[i].first;
	size_t width = (size_t)(w->x1 - w->x0);

	for (int y = w->y0; y < w->y1; y++, light += width, before += width) {
		uint8_t *row = image_row(canvas, w->x0, y);

		memcpy(before, row, width);
		sensor_expose(&canvas->sensor, rng, w->x0, y, light, row, width);
	}
}

/* The first window of a shared pixel has all its light and is drawn last, over the others. */
const uint8_t *canvas_expose(struct canvas *canvas, struct rng *rng)
{
	for (uint32_t i = 0; i < canvas->window_count; i++)
		for (uint32_t j = i + 1; j < canvas->window_count; j++)
			move_light(canvas, i, j);
	for (uint32_t i = canvas->window_count; i-- > 0;)
		expose_window(canvas, i, rng);
	return canvas->image;
}
