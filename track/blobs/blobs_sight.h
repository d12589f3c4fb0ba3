/*
 * Spots side by side, on their way from sums to windows.
 */
#pragma once

#include "track/blobs/blobs_float8.h"
#include "track/blobs/blobs_parts.h"

/* What is known of each spot. */
struct sight {
	float w[FIT_LANES], area[FIT_LANES], area_xx[FIT_LANES], area_xy[FIT_LANES],
		area_yy[FIT_LANES];
	float peak[FIT_LANES], level[FIT_LANES], background[FIT_LANES], contrast[FIT_LANES];
	float merged[FIT_LANES], size_px[FIT_LANES], clear_px[FIT_LANES];
};

/* What spots look like: second central moments, px2, and 0 for a Gaussian, 1 for a sharp disc. */
struct shapes {
	float8 xx, xy, yy, flatness;
};

struct shapes spot_shapes(const struct sight *sight);
