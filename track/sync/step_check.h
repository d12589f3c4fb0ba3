/*
 * Does a camera show the same instant as the others? Where markers move, a camera that is a shot
 * behind sees them where they were a shot ago: its residuals point back along the motion, by one
 * whole shot's worth. A bumped camera's residuals point anywhere. Flat, pure, real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/tracker.h"

/* Zero it. */
struct step_check {
	bool has_last;
	uint64_t last_shot;
	uint32_t turn; /* one camera a shot */
	bool seen[LABEL_MAX];
	struct vec3 last_m[LABEL_MAX];
	struct {
		double along_px2;  /* sum of residual times motion */
		double motion_px2; /* sum of motion squared */
	} cameras[CAMERA_MAX];
};

/* Looks at one camera of a tracked shot. True when enough has moved before it to tell: then
 * `camera` is off by `off_shots` shots (-1: it shows the shot before). */
bool step_check_run(struct step_check *check, const struct tracker_rig *rig,
		    const struct shot *shot, const struct marker_set *set, uint32_t *camera,
		    double *off_shots);
