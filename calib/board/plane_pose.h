/*
 * Where a camera stands to the board that it sees, by a pinhole: the start from which a calibration
 * is solved. Pure. Pixels are relative to the image's middle.
 */
#pragma once

#include <stdint.h>

#include "base/geometry.h"

/* The sums from which one camera's focal length follows: two constraints per homography on square
 * pixels and a principal point in the middle (Zhang 2000). A zeroed one is empty. */
struct focal_sums {
	uint32_t view_count;
	/* of a / f^2 + b = 0; [0] the board's axes are square to each other, [1] equally long */
	double product[2], square[2];
	double high[3], wide[3]; /* of the two axes' lengths, by powers of 1 / f^2 */
};

/* `h` leads from the board to pixels; `half_width_px` of the image. */
void focal_add(struct focal_sums *sums, const double h[9], double half_width_px);

/* Returns 0, or -EDOM when the views do not tell: the board was never tilted. */
int focal_from_sums(const struct focal_sums *sums, double half_width_px, double *focal_px);

/* How high the board's squares are over how wide, as far as these views tell; 1 when they do not.
 */
double focal_aspect(const struct focal_sums *sums);

/* The board's pose in camera coordinates and the rms (per corner, in pixels) of what is left: from
 * the homography, then Gauss-Newton, from both mirror images that a distant plane has; the better
 * one counts. `board_m` are the corners' places (z = 0); corners with NaN pixels are left out.
 * Returns 0 or -EDOM. */
int plane_pose_fit(struct pose *rt_cam_board, double *rms_px, const double (*board_m)[2],
		   const double (*px)[2], uint32_t count, double focal_px);
