/*
 * Does a camera still look where its calibration says? A bumped one sees everything shifted by the
 * same few tenths of a pixel. For each camera the shift is fitted that explains best what all views
 * of the named markers leave over, as in the test of one suspect observation among good ones
 * (Baarda, A testing procedure for use in geodetic networks, 1968). Flat, pure, real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/tracker.h"

#define AIM_CHECK_SHOTS 240 /* that one answer is taken from */

/* Zero it. */
struct aim_check {
	uint32_t shots; /* looked at since the last answer */
	uint32_t turn;  /* the label to go on with: a few each shot */
	struct {
		double left_px[2];     /* sum of what is left over */
		double free[2][2];     /* how much of a shift no other view takes up, summed */
		uint32_t tried, found; /* markers before it, and those with a spot there */
	} cameras[CAMERA_MAX];
	/* the answer: how far the picture of the camera that explains most is shifted, 0 of the
	 * others; of one that finds hardly any marker where it should be AIM_FAR_PX */
	double shift_px[CAMERA_MAX];
};

#define AIM_FAR_PX 2.0 /* spots farther from their places are not found */

/* Looks at some markers of a tracked shot. True when there is an answer, once in
 * AIM_CHECK_SHOTS shots. */
bool aim_check_run(struct aim_check *check, const struct tracker_rig *rig, const struct shot *shot,
		   const struct marker_set *set);
