/*
 * The background right around a spot, for places where the level map is too coarse: on a glow, on
 * skin, at the rim of either.
 */
#include <stdlib.h>

#include "track/blobs/blobs_parts.h"

#define GAP_PX 2   /* at least, between the spot and its ring */
#define STRIP_PX 3 /* thickness of the ring */

/* Median of the pixels [x0, x1) by [y0, y1) that lie in the image, or -1 when there are none. */
static int median_of(const struct grey_image *image, int x0, int x1, int y0, int y1)
{
	int bins[GREY_BINS] = {0}, count = 0, below = 0, bin = 0;

	x0 = x0 > 0 ? x0 : 0;
	y0 = y0 > 0 ? y0 : 0;
	x1 = x1 < image->width_px ? x1 : image->width_px;
	y1 = y1 < image->height_px ? y1 : image->height_px;
	for (int y = y0; y < y1; y++)
		for (int x = x0; x < x1; x++, count++)
			bins[grey_bin(image, grey_row(image, y)[x])]++;
	if (!count)
		return -1;
	while (2 * (below += bins[bin]) < count)
		bin++;
	return bin << grey_bin_shift(image);
}

bool ring_background(const struct grey_image *image, const struct spot *spot, struct plane *out,
		     float *brightest, float *contrast)
{
	int width = spot->x1 - spot->x0, height = spot->y1 - spot->y0;
	int gap = GAP_PX + (width > height ? width : height) / 4, far = gap + STRIP_PX;
	int left = median_of(image, spot->x0 - far, spot->x0 - gap, spot->y0 - gap, spot->y1 + gap);
	int right =
		median_of(image, spot->x1 + gap, spot->x1 + far, spot->y0 - gap, spot->y1 + gap);
	int above =
		median_of(image, spot->x0 - gap, spot->x1 + gap, spot->y0 - far, spot->y0 - gap);
	int below =
		median_of(image, spot->x0 - gap, spot->x1 + gap, spot->y1 + gap, spot->y1 + far);
	int across = left > right ? left : right, along = above > below ? above : below;

	if (left < 0 || right < 0 || above < 0 || below < 0)
		return false;
	out->slope_x = (float)(right - left) / (float)(width + gap + far);
	out->slope_y = (float)(below - above) / (float)(height + gap + far);
	out->value = 0.25f * (float)(left + right + above + below);
	*brightest = (float)(across > along ? across : along);
	*contrast = (float)(abs(right - left) > abs(below - above) ? abs(right - left)
								   : abs(below - above));
	return true;
}
