/*
 * Does a camera still look where its calibration says? A bumped one sees everything turned by the
 * same fraction of a milliradian. For each camera the turn is fitted that explains best what all
 * views of the named markers leave over, as in the test of one suspect observation among good ones
 * (Baarda, A testing procedure for use in geodetic networks, 1968). Flat, pure, real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/tracker.h"

#define AIM_BLOCKS 6 /* the answer is taken from so many of them, the newest */
#define AIM_BLOCK_NS INT64_C(250000000)
#define AIM_FAR_PX 2.0 /* spots farther from their places are not found */

/* Of one camera in one block. Turns are about its centre, in stage axes. */
struct aim_sums {
	double normal[3][3]; /* by the turn, of what no other view takes up */
	double left[3];      /* the turn's pull on what is left over */
	double reach[3][3];  /* by the turn, of the pictures alone, px2/rad2 */
	double weight;
	/* markers before it, those with a spot there, and those where the tracker took one */
	uint32_t tried, found, taken;
};

struct aim {
	double shift_px;  /* rms over its markers */
	double turn_mrad; /* 0 where no turn was fitted */
};

/* Zero it. */
struct aim_check {
	int64_t block_began_ns;
	uint32_t block; /* that is filled now */
	uint32_t turn;  /* the label to go on with: a few each shot */
	struct aim_sums cameras[AIM_BLOCKS][CAMERA_MAX];
	uint32_t doubted_mask; /* cameras whose spots the tracker often leaves out */
	/* the answer: of the camera that explains most how far it is off, 0 of the others; of one
	 * that finds hardly any marker where it should be AIM_FAR_PX */
	struct aim aims[CAMERA_MAX];
};

/* Looks at some markers of a tracked shot. True when there is an answer, once in AIM_BLOCK_NS. */
bool aim_check_run(struct aim_check *check, const struct tracker_rig *rig, const struct shot *shot,
		   const struct marker_set *set);
