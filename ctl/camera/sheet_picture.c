/*
 * A camera's picture on paper: which part of it, how light, how large.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ctl/camera/demosaic.h"
#include "ctl/camera/sheet_parts.h"

#define GAMMA 2.0      /* lifts the dark */
#define MARGIN_PX 45.0 /* around the marks, for the outermost names */
#define MAGNIFY_MAX 3.0

static double clamped(double value, double low, double high)
{
	return fmin(fmax(value, low), high);
}

/* The marks' box, with a margin; the whole picture when there are none. */
static void find_box(const struct sheet_tile *tile, double low[2], double high[2])
{
	const double size[2] = {tile->snapshot->width_px, tile->snapshot->height_px};

	for (int k = 0; k < 2; k++) {
		low[k] = size[k];
		high[k] = 0;
	}
	for (uint32_t i = 0; i < tile->mark_count; i++) {
		const double at[2] = {tile->marks[i].x_px, tile->marks[i].y_px};

		if (tile->marks[i].kind == SHEET_STRAY)
			continue;
		for (int k = 0; k < 2; k++) {
			low[k] = fmin(low[k], at[k]);
			high[k] = fmax(high[k], at[k]);
		}
	}
	for (int k = 0; k < 2; k++) {
		bool none = low[k] > high[k];

		low[k] = none ? 0 : low[k] - MARGIN_PX;
		high[k] = none ? size[k] : high[k] + MARGIN_PX;
	}
}

void sheet_frame_choose(struct sheet_frame *frame, const struct sheet_tile *tile, bool whole)
{
	double low[2] = {0, 0}, high[2] = {tile->snapshot->width_px, tile->snapshot->height_px};
	double size_px[2] = {high[0], high[1]}, paper[2] = {frame->width, frame->height};
	double smallest = fmin(paper[0] / size_px[0], paper[1] / size_px[1]);

	if (!whole)
		find_box(tile, low, high);
	frame->scale = clamped(fmin(paper[0] / (high[0] - low[0]), paper[1] / (high[1] - low[1])),
			       smallest, MAGNIFY_MAX);
	for (int k = 0; k < 2; k++) {
		double shown_px = paper[k] / frame->scale;

		frame->origin_px[k] = 0.5 * (low[k] + high[k] - shown_px);
		frame->origin_px[k] = shown_px >= size_px[k] ? 0.5 * (size_px[k] - shown_px)
							     : clamped(frame->origin_px[k], 0,
								       size_px[k] - shown_px);
	}
}

static void fill_curve(uint8_t curve[256])
{
	for (int i = 0; i < 256; i++)
		curve[i] = (uint8_t)lround(255 * pow(i / 255.0, 1 / GAMMA));
}

/* Three bytes a pixel; NULL without memory. */
static uint8_t *to_rgb(const struct snapshot *snapshot)
{
	size_t count = (size_t)snapshot->width_px * (size_t)snapshot->height_px;
	uint8_t *rgb = malloc(3 * count);

	if (!rgb)
		return NULL;
	if (snapshot->format == PIXEL_BAYER_RG8)
		demosaic(snapshot->pixels, snapshot->width_px, snapshot->height_px, PIXEL_BAYER_RG8,
			 rgb);
	else if (snapshot->format == PIXEL_RGB8)
		memcpy(rgb, snapshot->pixels, 3 * count);
	else
		for (size_t i = 0; i < count; i++)
			memset(rgb + 3 * i, snapshot->pixels[i], 3);
	return rgb;
}

static void fill_surface(cairo_surface_t *surface, const struct snapshot *snapshot,
			 const uint8_t *rgb)
{
	uint8_t *rows = cairo_image_surface_get_data(surface);
	size_t stride = (size_t)cairo_image_surface_get_stride(surface);
	uint8_t curve[256];

	fill_curve(curve);
	for (int y = 0; y < snapshot->height_px; y++) {
		uint32_t *out = (uint32_t *)(void *)(rows + (size_t)y * stride);

		for (int x = 0; x < snapshot->width_px; x++, rgb += 3)
			out[x] = (uint32_t)curve[rgb[0]] << 16 | (uint32_t)curve[rgb[1]] << 8 |
				 curve[rgb[2]];
	}
	cairo_surface_mark_dirty(surface);
}

/* A snapshot as a picture for cairo; NULL without memory. */
static cairo_surface_t *make_surface(const struct snapshot *snapshot)
{
	cairo_surface_t *surface = cairo_image_surface_create(
		CAIRO_FORMAT_RGB24, snapshot->width_px, snapshot->height_px);
	uint8_t *rgb = to_rgb(snapshot);

	if (!rgb || cairo_surface_status(surface) != CAIRO_STATUS_SUCCESS) {
		cairo_surface_destroy(surface);
		free(rgb);
		return NULL;
	}
	cairo_surface_flush(surface);
	fill_surface(surface, snapshot, rgb);
	free(rgb);
	return surface;
}

int sheet_paint_picture(cairo_t *cr, const struct sheet_frame *frame,
			const struct snapshot *snapshot)
{
	cairo_surface_t *surface = make_surface(snapshot);

	if (!surface)
		return -ENOMEM;
	cairo_save(cr);
	cairo_rectangle(cr, frame->left, frame->top, frame->width, frame->height);
	cairo_set_source_rgb(cr, 0.05, 0.05, 0.06);
	cairo_fill_preserve(cr);
	cairo_clip(cr);
	cairo_translate(cr, frame->left, frame->top);
	cairo_scale(cr, frame->scale, frame->scale);
	/* pixel (0,0) is a middle, not a corner */
	cairo_set_source_surface(cr, surface, -frame->origin_px[0], -frame->origin_px[1]);
	cairo_pattern_set_filter(cairo_get_source(cr), CAIRO_FILTER_GOOD);
	cairo_paint(cr);
	cairo_restore(cr);
	cairo_surface_destroy(surface);
	return 0;
}
