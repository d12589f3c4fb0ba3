/*
 * Where the stage frame is: by a board that lies on the floor, or by an L-frame of three markers.
 */
#pragma once

#include "base/diag.h"
#include "calib/board/observations.h"
#include "calib/rig/marker_shots.h"
#include "config/rig.h"

struct origin {
	struct pose
		rt_new_stage; /* takes coordinates of the stage frame until now to the new one */
	double off_mm;        /* rms of what was measured from how the board or L-frame is */
	uint32_t point_count; /* of the board, or of the L-frame over all shots */
};

/* The board at rest: origin at its first inner corner, x to the right along its squares, z up out
 * of the print. Returns 0, or -EINVAL with a message. */
int origin_of_board(struct origin *origin, const struct rig *rig,
		    const struct observations *observations, struct diag *diag);

/* Markers at the corner and at both ends of the arms: origin at the corner, x along the long arm, y
 * along the short one, which is to the left of it as seen from above. Returns 0, or -EINVAL with
 * a message. */
int origin_of_l_frame(struct origin *origin, const struct rig *rig,
		      const struct marker_shots *shots, double long_m, double short_m,
		      struct diag *diag);
