/*
 * Bilinear: of the 3x3 pixels around each pixel, the mean of those of each colour. The pixel's own
 * colour is its own value. At the border the window is cut off.
 */
#include "ctl/demosaic.h"

#include <stddef.h>

enum { RED, GREEN, BLUE, COLOURS };

static int colour_at(int x, int y)
{
	static const int pattern[2][2] = {{RED, GREEN}, {GREEN, BLUE}};

	return pattern[y & 1][x & 1];
}

static void fill_pixel(const uint8_t *mosaic, int width, int height, int x, int y, uint8_t *rgb)
{
	int sums[COLOURS] = {0}, counts[COLOURS] = {0};

	for (int v = y > 0 ? y - 1 : y; v <= y + 1 && v < height; v++)
		for (int u = x > 0 ? x - 1 : x; u <= x + 1 && u < width; u++) {
			int colour = colour_at(u, v);

			sums[colour] += mosaic[(size_t)v * (size_t)width + (size_t)u];
			counts[colour]++;
		}
	for (int k = 0; k < COLOURS; k++)
		rgb[k] = (uint8_t)(counts[k] ? (sums[k] + counts[k] / 2) / counts[k] : 0);
	rgb[colour_at(x, y)] = mosaic[(size_t)y * (size_t)width + (size_t)x];
}

void demosaic_rggb(const uint8_t *mosaic, int width_px, int height_px, uint8_t *rgb)
{
	for (int y = 0; y < height_px; y++)
		for (int x = 0; x < width_px; x++, rgb += COLOURS)
			fill_pixel(mosaic, width_px, height_px, x, y, rgb);
}
