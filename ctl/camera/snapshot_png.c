/*
 * Snapshots as PNG files, in colour so that the circles stand out.
 */
#include <errno.h>
#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "base/output_file.h"
#include "ctl/camera/demosaic.h"
#include "ctl/camera/snapshot.h"

#define CIRCLE_GAP_PX 4.0 /* between a spot's edge and its circle */

static uint8_t *to_rgb(const struct snapshot *snapshot)
{
	size_t count = (size_t)snapshot->width_px * (size_t)snapshot->height_px;
	uint8_t *rgb = malloc(3 * count);

	if (!rgb)
		return NULL;
	if (snapshot->format == PIXEL_RGB8) {
		memcpy(rgb, snapshot->pixels, 3 * count);
		return rgb;
	}
	if (snapshot->format == PIXEL_BAYER_RG8) {
		demosaic(snapshot->pixels, snapshot->width_px, snapshot->height_px, PIXEL_BAYER_RG8,
			 rgb);
		return rgb;
	}
	for (size_t i = 0; i < count; i++)
		memset(rgb + 3 * i, snapshot->pixels[i], 3);
	return rgb;
}

static void draw_circle(uint8_t *rgb, const struct snapshot *snapshot, const struct blob *blob)
{
	static const uint8_t colour[3] = {80, 255, 80};
	double radius_px = sqrt(blob->area_px2 / M_PI) + CIRCLE_GAP_PX;
	int steps = (int)(8 * radius_px) + 8;

	for (int s = 0; s < steps; s++) {
		double angle = 2 * M_PI * s / steps;
		long x = lround(blob->x_px + radius_px * cos(angle));
		long y = lround(blob->y_px + radius_px * sin(angle));

		if (x >= 0 && y >= 0 && x < snapshot->width_px && y < snapshot->height_px)
			memcpy(rgb + 3 * ((size_t)y * (size_t)snapshot->width_px + (size_t)x),
			       colour, 3);
	}
}

int snapshot_write_png(const struct snapshot *snapshot, const char *path)
{
	png_image image = {.version = PNG_IMAGE_VERSION,
			   .width = (png_uint_32)snapshot->width_px,
			   .height = (png_uint_32)snapshot->height_px,
			   .format = PNG_FORMAT_RGB,
			   .flags = PNG_IMAGE_FLAG_FAST};
	struct output_file file;
	int err = output_file_open(&file, path, NULL);

	if (err)
		return err;
	uint8_t *rgb = to_rgb(snapshot);
	for (uint32_t b = 0; rgb && b < snapshot->blob_count; b++)
		draw_circle(rgb, snapshot, &snapshot->blobs[b]);
	errno = 0;
	if (!rgb)
		err = -ENOMEM;
	else if (!png_image_write_to_stdio(&image, file.stream, 0, rgb, 0, NULL))
		err = errno ? -errno : -EIO;
	free(rgb);
	return output_file_end(&file, err, NULL);
}
