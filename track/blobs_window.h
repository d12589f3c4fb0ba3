/*
 * Sums over a small window of pixels around a spot: its second moments, and one Newton step of the
 * windowed first moment together with the step's variance. Single-precision SIMD in a fixed order.
 */
#pragma once

#include "track/blobs_parts.h"

/* Pixels [x0, x1) by [y0, y1), all inside the image; x1 - x0 is a multiple of 4. */
struct window {
	int x0, x1, y0, y1;
};

/* The window of at least these half widths around (x, y). Returns false when the image is too
 * small for it. */
bool window_around(const struct grey_image *image, float x_px, float y_px, float half_x_px,
		   float half_y_px, struct window *out);

struct shape {
	float flux;       /* grey values x px2 above the background */
	float xx, xy, yy; /* second central moments, px2 */
};

/* `background` is the plane around (x, y). Returns false when there is no flux. */
bool window_moments(const struct grey_image *image, const struct window *window,
		    const struct plane *background, float x_px, float y_px, struct shape *out);

/* The centroid is the zero of sum(d w(u) S), where d = (x, y) - centre, S = I - background and
 * u = d' q d is the squared distance in units of the spot's own size. With w Gaussian this is
 * SExtractor's windowed position (Bertin & Arnouts); the rings give the edge of a flat disc, where
 * its position is written, the weight it deserves. w ends smoothly at u = 4. */
struct kernel {
	float qxx, qxy, qyy;
	float ring[3];        /* w = (ring[0] + ring[1] u + ring[2] u2) (1 - u2 / 16)^2 */
	float noise_variance; /* of a dark pixel, grey values squared */
	float electrons_per_grey;
};

struct newton_step {
	float dx, dy;
	float variance; /* of the centroid, mean of both axes, px2 */
};

/* Returns false when the window holds nothing with a centroid. */
bool window_newton(const struct grey_image *image, const struct window *window,
		   const struct plane *background, const struct kernel *kernel, float x_px,
		   float y_px, struct newton_step *out);
