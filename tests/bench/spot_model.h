/*
 * Exact spots for the bench of centroids, apart from sim/: a uniform disc seen through a lens whose
 * point spread is a Gaussian or a Moffat function (wide wings, as diffraction and glass make them),
 * integrated over square pixels.
 *
 * Both are round, so a spot is a function of the radius alone: an integral over circles around the
 * point, of the share of each that lies in the disc. The pixel's integral is Gauss-Legendre's.
 */
#pragma once

#include <stdint.h>

#include "base/rng.h"

enum point_spread {
	SPREAD_GAUSS,
	SPREAD_MOFFAT, /* exponent 3, of the same width at half height */
	SPREAD_COUNT,
};

struct spot_model {
	enum point_spread spread;
	double diameter_px, blur_px; /* standard deviation of the Gaussian */
	double amplitude;            /* of the brightest point, grey values */
};

#define STAMP_HALF_PX 24
#define STAMP_PX (2 * STAMP_HALF_PX + 1)

/* A spot's light, and its slopes by the centre; (x, y) is where the centre is off that of the
 * middle pixel. */
struct spot_stamp {
	float light[STAMP_PX][STAMP_PX];
	float slope_x[STAMP_PX][STAMP_PX], slope_y[STAMP_PX][STAMP_PX];
};

void spot_stamp_draw(struct spot_stamp *stamp, const struct spot_model *model, double x, double y);

/* The least possible standard deviation of x and y (rms of the two) of an unbiased estimate: from
 * the Fisher information of each pixel's grey value, with read and photon noise, rounded and
 * clipped to 8 bits. */
double spot_stamp_bound(const struct spot_stamp *stamp);

/* What a camera would say: light plus noise, rounded and clipped. */
uint8_t exposed_pixel(double light, struct rng *rng);
