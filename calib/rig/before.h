/*
 * A new calibration beside the rig from before: it gets that one's stage frame, and what has moved
 * is told camera by camera.
 */
#pragma once

#include <stdbool.h>

#include "base/geometry.h"
#include "calib/solve/solve.h"
#include "config/rig.h"

/* A camera in the stage frame, against where it was. */
struct camera_move {
	bool known; /* it was in the rig from before */
	double moved_mm, turned_mrad;
};

/* Those models of the cameras that are in `dir` and can be read, in the order of the observations;
 * a rig without cameras when there are none. Returns 0 or -ENOMEM. */
int rig_before(struct rig *before, const char *dir, const struct observations *observations);

/* Says so for every camera whose pictures are not the size that its model is for. Returns 0 or
 * -EINVAL. */
int rig_before_check_sizes(const struct rig *before, const char *dir,
			   const struct observations *observations, struct diag *diag);

/* The pose that brings camera 0's coordinates to the stage's of before: by the centres of three or
 * more cameras, else by one camera; with none it is the identity. `moves` has a place for each
 * camera. */
struct pose rig_before_frame(const struct rig *before, const struct observations *observations,
			     const struct solution *solution, struct camera_move *moves);
