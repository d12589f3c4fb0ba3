/*
 * Pixels of a mosaic.
 */
#include "hd_spots.h"

#include <math.h>
#include <stdlib.h>

#define HALF_PX 5 /* of the window around a spot */
#define WINDOW_SIGMA_PX 1.7
#define SPREAD_MAX_GREY 3.3

/* Green is where row and column differ in parity. */
static bool is_green(int x, int y)
{
	return (x + y) % 2 != 0;
}

/* Mean and spread of the green pixels along the window's rim: the skin around the spot. */
static double rim_grey(const struct hd_picture *picture, int x0, int y0, double *spread)
{
	double sum = 0, sum2 = 0;
	int count = 0;

	for (int y = y0 - HALF_PX; y <= y0 + HALF_PX; y++)
		for (int x = x0 - HALF_PX; x <= x0 + HALF_PX; x++)
			if ((abs(x - x0) == HALF_PX || abs(y - y0) == HALF_PX) && is_green(x, y)) {
				double grey = picture->pixels[y * picture->width_px + x];

				sum += grey;
				sum2 += grey * grey;
				count++;
			}
	*spread = sqrt(sum2 / count - sum / count * sum / count);
	return sum / count;
}

bool hd_spot_is_on_even_skin(const struct hd_picture *picture, const double near[2])
{
	double spread;

	rim_grey(picture, (int)lround(near[0]), (int)lround(near[1]), &spread);
	return spread < SPREAD_MAX_GREY;
}

void hd_spot_centroid(const struct hd_picture *picture, const double near[2], double out[2])
{
	int x0 = (int)lround(near[0]), y0 = (int)lround(near[1]);
	double spread, rim = rim_grey(picture, x0, y0, &spread);

	out[0] = x0;
	out[1] = y0;
	for (int step = 0; step < 12; step++) {
		double sum = 0, sum_x = 0, sum_y = 0;

		for (int y = y0 - HALF_PX; y <= y0 + HALF_PX; y++)
			for (int x = x0 - HALF_PX; x <= x0 + HALF_PX; x++) {
				double dx = x - out[0], dy = y - out[1];
				double w = exp(-0.5 * (dx * dx + dy * dy) /
					       (WINDOW_SIGMA_PX * WINDOW_SIGMA_PX));

				w *= is_green(x, y) *
				     (picture->pixels[y * picture->width_px + x] - rim);
				sum += w;
				sum_x += w * dx;
				sum_y += w * dy;
			}
		out[0] += 2 * sum_x / sum;
		out[1] += 2 * sum_y / sum;
	}
}
