/*
 * Where two edges of a checkerboard cross, to a few hundredths of a pixel: least squares of the
 * blurred crossing itself, I = base + half * erf(d1 / s1 sqrt 2) * erf(d2 / s2 sqrt 2), with d1 and
 * d2 the distances to the two lines. The crossing looks the same turned by half a circle, and so do
 * the model and the window: what is wrong about the blur's shape does not move it. Pure.
 */
#pragma once

#include <math.h>

#include "track/blobs/blobs.h"

/* What is known before: the place, and one square's edges in pixels there. */
struct saddle_guess {
	double px[2];
	double along_x_px[2], along_y_px[2];
};

/* The shorter edge. */
static inline double saddle_edge_px(const struct saddle_guess *guess)
{
	return fmin(hypot(guess->along_x_px[0], guess->along_x_px[1]),
		    hypot(guess->along_y_px[0], guess->along_y_px[1]));
}

struct saddle {
	double px[2];      /* (0,0) is the centre of the top-left pixel */
	double blur_px[2]; /* of the two edges, one sigma each: motion blurs them unequally */
	double contrast; /* white less black, grey values; negative where the first square is white
			  */
	double misfit;   /* rms of what is left over half the contrast */
};

/* Pixels within SADDLE_ACROSS of a square beside either line and SADDLE_ALONG along it, at most
 * SADDLE_ALONG_MAX_PX, are read; tags begin at 0.11 of a square at the nearest. */
#define SADDLE_ACROSS 0.12
#define SADDLE_ALONG 0.3
#define SADDLE_ALONG_MAX_PX 8.0

/* Returns 0, or -EDOM when there is no such crossing near or it is too close to the border. */
int saddle_fit(struct saddle *saddle, const struct grey_image *image,
	       const struct saddle_guess *guess);
