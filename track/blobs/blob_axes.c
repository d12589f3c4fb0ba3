/*
 * The principal axes of second moments, and how well a blob's are known.
 */
#include "track/blobs/blob_axes.h"

#include <math.h>

#define MODEL_ERROR 0.1          /* of a spread: spots are neither Gaussians nor discs */
#define MODEL_ERROR_CLIPPED 0.35 /* clipping widens what is left */
#define GRID_ERROR_PX2 0.1       /* small spots are counted in whole pixels */

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
