/*
 * The start of a calibration: focal lengths, cameras and board poses that are right to a few
 * pixels, from homographies and a tree of cameras that saw the board together. What cannot be
 * calibrated is found here, and said with its remedy. A bad start would still "converge", minutes
 * later, somewhere.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "base/geometry.h"
#include "calib/board/observations.h"

#define SEED_VIEWS_MIN 8   /* of each camera */
#define SEED_CORNERS_MIN 8 /* of a view that counts */
#define SEED_ASPECT_TOLERANCE 0.004
#define SEED_LINKS_MIN 3 /* poses that link two cameras */

struct seed {
	uint32_t pose_count;
	double focal_px[CAMERA_MAX];
	double board_aspect; /* height of squares over their width, roughly; median of cameras */
	struct pose rt_cam_ref[CAMERA_MAX]; /* the reference is camera 0: identity */
	struct pose *rt_ref_board;          /* owned; of the nth pose of the observations */
	bool *good_view;  /* owned; false: too few corners, or it contradicts the others */
	double rms_px;    /* of all corners of good views, by pinholes */
	uint32_t refused; /* views that are not good */
};

/* Returns 0, -EINVAL with a message per camera that is wrong, or -ENOMEM. */
int seed_make(struct seed *seed, const struct observations *observations, struct diag *diag);
void seed_finish(struct seed *seed); /* zeroed is fine */
