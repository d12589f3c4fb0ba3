/*
 * Where cameras stand now, from some seconds of named markers: lenses are held, and so are all
 * cameras that still look where the rig says, which keeps stage frame and scale. Those that moved
 * are found one by one and solved together with the points that they see. Where the rig is too far
 * off for names, points without one serve.
 */
#pragma once

#include <stdbool.h>

#include "base/diag.h"
#include "calib/rig/marker_shots.h"
#include "config/rig.h"

struct refined_camera {
	uint32_t view_count; /* of named markers */
	bool judged;         /* it saw enough of them to tell */
	bool moved;
	double off_px;                /* how far its pictures lay off, rms; 0 unless it moved */
	double turned_mrad, moved_mm; /* how it stands now to how it stood; 0 unless it moved */
	double before_px, after_px;   /* rms of what its markers leave over */
	struct pose rt_cam_stage;     /* now */
};

struct refined {
	uint32_t camera_count, moved_count;
	uint32_t shot_count, marker_count; /* that it was found from */
	bool named;                        /* by markers with names */
	struct refined_camera cameras[CAMERA_MAX];
};

#define REFINE_SHOTS_MIN 30
#define REFINE_OFF_MAX_PX 40.0 /* a camera farther off is not found */

/* Cameras of `shots` are those of the rig. Returns 0, also when nobody moved; -EINVAL with messages
 * when the data are too few or do not agree; or -ENOMEM. */
int refine(struct refined *refined, const struct rig *rig, const struct marker_shots *shots,
	   struct diag *diag);
