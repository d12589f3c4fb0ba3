/*
 * The other way from an outline to pixels, for a lens with scattered light and a sensor with gaps:
 * a Moffat point spread, a disc of defocus and the pixel's lit part are convolved once,
 * numerically, into kernels. The outline is cut into slices, these are laid on a grid finer than
 * the pixels, and the kernels spread the grid. What scatters widely comes on top, as a halo.
 * (Moffat 1969, "A theoretical investigation of focal stellar images".)
 */
#pragma once

#include "sim/render/spot.h"

#define TAIL_REACH_PX 7
#define TAIL_SIDE (2 * TAIL_REACH_PX + 1)
#define TAIL_PHASES 4 /* places of the fine grid in a pixel, each way */
#define TAIL_LEVELS 9 /* of defocus, from none to 4 px */
#define TAIL_LEVELS_PER_PX 2
#define TAIL_GRID_MAX (4 * SPOT_HALF_WIDTH_PX + 8) /* cells each way */

struct tail_blur {
	/* set when made */
	float kernels[TAIL_LEVELS][TAIL_PHASES * TAIL_PHASES][TAIL_SIDE * TAIL_SIDE];
	/* owned by the thread that draws */
	float kernel[TAIL_PHASES * TAIL_PHASES][TAIL_SIDE * TAIL_SIDE]; /* of one spot */
	float grid[TAIL_GRID_MAX * TAIL_GRID_MAX];
};

/* `moffat_px` is the radius in (1 + r^2 / radius^2)^-2.5. Returns 0 or -ENOMEM. destroy accepts
 * NULL. */
int tail_blur_create(struct tail_blur **out, double moffat_px);
void tail_blur_destroy(struct tail_blur *blur);

/* As spot_window() and spot_fill(). */
struct pixel_window tail_spot_window(const struct spot *spot, int width_px, int height_px);
void tail_spot_fill(struct tail_blur *blur, const struct spot *spot,
		    const struct pixel_window *window, float *light);
