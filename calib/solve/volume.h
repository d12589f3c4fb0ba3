/*
 * Points of the stage at which a calibration is judged: a grid in the box in which the board was
 * waved, or in any other.
 */
#pragma once

#include "base/geometry.h"
#include "calib/board/observations.h"
#include "calib/solve/solve.h"
#include "track/rigid.h"

#define VOLUME_SIDE 5
#define VOLUME_POINT_MAX (VOLUME_SIDE * VOLUME_SIDE * VOLUME_SIDE)

struct volume {
	uint32_t count;
	struct vec3 p_ref_m[VOLUME_POINT_MAX];
	uint32_t camera_mask[VOLUME_POINT_MAX]; /* two or more cameras have it in their image */
};

/* The points that two cameras see of the box in which nine tenths of the board's middles were,
 * along the axes of camera 0. Returns 0, or -EDOM when there are fewer than four. */
int volume_of_poses(struct volume *volume, const struct solution *solution,
		    const struct observations *observations);

/* Where `other`, a calibration of the same cameras, would have the volume's points if it saw them
 * where `solution` does, brought as near as a rigid motion can: the rms of what is left, metres.
 * Returns 0 or -EDOM. */
int volume_difference(const struct volume *volume, const struct solution *solution,
		      const struct solution *other, double *rms_m);
