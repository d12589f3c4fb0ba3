/*
 * The same corners through mrcal-calibrate-cameras, the yardstick, where it is installed.
 */
#pragma once

#include "calib/solve/solve.h"

struct tool_result {
	double rms_px; /* as mrcal counts: over all corners of the board in all views */
	double seconds;
	struct vec3 centre_m[CAMERA_MAX]; /* in coordinates of camera 0 */
};

/* All cameras have the size of the first. Returns 0, -ENOENT when the tool is not installed, or
 * -EIO when it fails. */
int tool_calibrate(struct tool_result *result, const struct observations *observations);
