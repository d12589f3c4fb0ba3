/*
 * Bilinear: of the 3x3 pixels around each pixel, the mean of those of each colour. The pixel's own
 * colour is its own value. At the border the window is cut off.
 */
#include "ctl/camera/demosaic.h"

#include <stddef.h>

enum { RED, GREEN, BLUE, COLOURS };

/* Every order is RGGB from a pixel to the right, or down, or both. */
struct mosaic {
	const uint8_t *pixels;
	int width, height, right, down;
};

static int colour_at(const struct mosaic *m, int x, int y)
{
	static const int pattern[2][2] = {{RED, GREEN}, {GREEN, BLUE}};

	return pattern[(y + m->down) & 1][(x + m->right) & 1];
}

static void fill_pixel(const struct mosaic *m, int x, int y, uint8_t *rgb)
{
	int sums[COLOURS] = {0}, counts[COLOURS] = {0};

	for (int v = y > 0 ? y - 1 : y; v <= y + 1 && v < m->height; v++)
		for (int u = x > 0 ? x - 1 : x; u <= x + 1 && u < m->width; u++) {
			int colour = colour_at(m, u, v);

			sums[colour] += m->pixels[(size_t)v * (size_t)m->width + (size_t)u];
			counts[colour]++;
		}
	for (int k = 0; k < COLOURS; k++)
		rgb[k] = (uint8_t)(counts[k] ? (sums[k] + counts[k] / 2) / counts[k] : 0);
	rgb[colour_at(m, x, y)] = m->pixels[(size_t)y * (size_t)m->width + (size_t)x];
}

void demosaic(const uint8_t *mosaic, int width_px, int height_px, enum pixel_format order,
	      uint8_t *rgb)
{
	const struct mosaic m = {.pixels = mosaic,
				 .width = width_px,
				 .height = height_px,
				 .right = order == PIXEL_BAYER_GR8 || order == PIXEL_BAYER_BG8,
				 .down = order == PIXEL_BAYER_GB8 || order == PIXEL_BAYER_BG8};

	for (int y = 0; y < height_px; y++)
		for (int x = 0; x < width_px; x++, rgb += COLOURS)
			fill_pixel(&m, x, y, rgb);
}
