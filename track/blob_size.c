/*
 * Moments of two equal spots s apart: one spot's, plus s2/4 along the line between them.
 */
#include "track/blob_size.h"

#include <math.h>

#define DISC_SHARE (1 / 16.0)    /* of D2, a uniform disc's spread along one axis */
#define MODEL_ERROR 0.1          /* of a spread: spots are neither Gaussians nor discs */
#define MODEL_ERROR_CLIPPED 0.35 /* clipping widens what is left */
#define GRID_ERROR_PX2 0.1       /* small spots are counted in whole pixels */
#define BLUR_ERROR 0.1
#define CLEARLY 2 /* standard deviations by which two markers are longer than one */

/* A centroid of n photons errs by sqrt(spread / n), the spread itself by sqrt(2 / n) spreads. */
static double spread_sigma_px2(const struct blob *blob, double spread_px2)
{
	double noise = sqrt(2 * spread_px2) * (double)blob->sigma_px;
	double model = blob->flags & BLOB_SATURATED ? MODEL_ERROR_CLIPPED : MODEL_ERROR;

	return hypot(hypot(noise, GRID_ERROR_PX2), model * spread_px2);
}

bool blob_axes(const struct blob *blob, struct blob_axes *out)
{
	double xx = blob->shape_px2[0], xy = blob->shape_px2[1], yy = blob->shape_px2[2];
	double mean = (xx + yy) / 2, half = hypot((xx - yy) / 2, xy);

	if (!(mean > 0))
		return false;
	*out = (struct blob_axes){
		.major_px2 = mean + half,
		.minor_px2 = mean - half,
		.sigma_px2 = spread_sigma_px2(blob, mean + half),
		.angle_rad = atan2(2 * xy, xx - yy) / 2,
	};
	return true;
}

bool blob_estimate_diameter(const struct blob *blob, double m_per_px, double blur_px2,
			    struct blob_diameter *out)
{
	struct blob_axes axes;
	double spread_px2, sigma_px2, diameter_px;

	if (blob->flags & (BLOB_MERGED | BLOB_EDGE) || !blob_axes(blob, &axes))
		return false;
	spread_px2 = fmax(axes.major_px2 - blur_px2, 0);
	sigma_px2 = hypot(axes.sigma_px2, BLUR_ERROR * blur_px2);
	diameter_px = sqrt(spread_px2 / DISC_SHARE);
	/* The square root's slope, but bounded where the disc vanishes in the blur. */
	out->diameter_m = m_per_px * diameter_px;
	out->sigma_m = m_per_px * (sqrt((spread_px2 + sigma_px2) / DISC_SHARE) - diameter_px);
	return true;
}

bool blob_split_two(const struct blob *blob, double part_px2, struct blob out[2])
{
	struct blob_axes axes;
	double excess_px2, half_px, along_px;

	if (!blob_axes(blob, &axes))
		return false;
	excess_px2 = axes.major_px2 - part_px2;
	if (excess_px2 < CLEARLY * axes.sigma_px2)
		return false;
	half_px = sqrt(excess_px2);
	along_px = axes.sigma_px2 / (2 * half_px);
	for (int i = 0; i < 2; i++) {
		double away_px = i ? half_px : -half_px;

		out[i] = *blob;
		out[i].x_px += (float)(away_px * cos(axes.angle_rad));
		out[i].y_px += (float)(away_px * sin(axes.angle_rad));
		out[i].sigma_px = (float)hypot((double)blob->sigma_px, along_px);
		out[i].area_px2 /= 2;
		out[i].flags |= BLOB_MERGED;
		out[i].shape_px2[0] = out[i].shape_px2[2] = (float)part_px2;
		out[i].shape_px2[1] = 0;
	}
	return true;
}
