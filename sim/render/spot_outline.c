/*
 * What both ways of drawing a spot need to know of its outline.
 */
#include <math.h>

#include "sim/render/spot.h"

static int clamped(double value, int low, int high)
{
	return value < low ? low : value > high ? high : (int)value;
}

struct pixel_window pixel_window_around(const double centre_px[2], double reach_px, int width_px,
					int height_px)
{
	const double *c = centre_px;
	double reach = fmin(reach_px, SPOT_HALF_WIDTH_PX);

	return (struct pixel_window){clamped(floor(c[0] - reach), 0, width_px),
				     clamped(floor(c[1] - reach), 0, height_px),
				     clamped(ceil(c[0] + reach) + 1, 0, width_px),
				     clamped(ceil(c[1] + reach) + 1, 0, height_px)};
}

double spot_radius_px(const struct spot *spot)
{
	const double(*a)[2] = spot->axes_px;
	double xx = a[0][0] * a[0][0] + a[0][1] * a[0][1];
	double yy = a[1][0] * a[1][0] + a[1][1] * a[1][1];
	double xy = a[0][0] * a[1][0] + a[0][1] * a[1][1];

	return sqrt(0.5 * (xx + yy) + hypot(0.5 * (xx - yy), xy));
}

double spot_light(const struct spot *spot)
{
	const double(*a)[2] = spot->axes_px;

	return spot->brightness * M_PI * fabs(a[0][0] * a[1][1] - a[0][1] * a[1][0]) *
	       (1 - 0.5 * spot->squeeze);
}

/* A half disc's centroid is 4 / 3 pi from the middle. Near half: area 1, moment 1; far half: area
 * 1 - squeeze, moment (1 - squeeze)^2 the other way. */
void spot_centroid(const struct spot *spot, double out[2])
{
	double far = 1 - spot->squeeze;
	double shift = 4 / (3 * M_PI) * (1 - far * far) / (1 + far);

	for (int i = 0; i < 2; i++)
		out[i] = spot->centre_px[i] + shift * spot->axes_px[i][1];
}
