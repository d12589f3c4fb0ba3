/*
 * The sums of a spot over its own pixels: integers, whatever the order.
 */
#include "track/blobs/blobs_parts.h"

static void sum_light(struct spot *spot, const struct run *runs, const struct grey_image *image)
{
	const int white = grey_white(image);

	spot->w = spot->wx = spot->wy = spot->peak = 0;
	for (uint32_t r = spot->first_run; r != RUN_NONE; r = runs[r].next)
		for (int x = runs[r].x0; x < runs[r].x1; x++) {
			int seen = grey_row(image, runs[r].y)[x],
			    value = seen < white ? seen : white;
			int64_t w = value > spot->level ? value - spot->level : 0;

			spot->peak = value > spot->peak ? value : spot->peak;
			spot->w += w;
			spot->wx += w * (x - spot->x0);
			spot->wy += w * (runs[r].y - spot->y0);
		}
}

/* Second moments of the pixels' areas, not of their middles: a run of n around m has
 * n m2 + n3 / 12 in x. */
void spot_area_moments(struct spot *spot)
{
	const struct area_sums *sums = &spot->area;
	double n = spot->area_px2, x = 0.5 * (double)sums->x / n, y = (double)sums->y / n;

	spot->area_xx = (float)((0.25 * (double)sums->xx + (double)sums->cubes / 12) / n - x * x);
	spot->area_xy = (float)(0.5 * (double)sums->xy / n - x * y);
	spot->area_yy = (float)((double)sums->yy / n - y * y + 1 / 12.0);
}

void spot_sum(struct spot *spot, const struct run *runs, const struct grey_image *image)
{
	if (!spot_sum_short(spot, runs, image))
		sum_light(spot, runs, image);
	spot_area_moments(spot);
}
