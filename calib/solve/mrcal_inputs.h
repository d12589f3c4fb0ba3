/*
 * A solved calibration as mrcal's Python wants it, for tools that look at how it was solved.
 */
#pragma once

#include <stdio.h>

#include "calib/solve/solve.h"

/* A line of JSON (lens, square_m, cameras, counts), then the numbers as this machine has them:
 * doubles intrinsics [camera][lens_count], rt_cam_ref [camera - 1][6], rt_ref_board [frame][6],
 * warp [2], corners [view][y][x][3] with mrcal's weights, and int32 [view][3]: frame, camera,
 * camera - 1. Returns 0 or a negative errno. */
int mrcal_inputs_print(FILE *file, const struct observations *observations,
		       const struct solution *solution);
