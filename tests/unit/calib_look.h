/*
 * Pictures of a waved board, rendered, searched for corners, and compared with the truth.
 */
#pragma once

#include "calib/board/corners.h"
#include "sim/world/scene_parts.h"

#define LOOK_SQUARE_MIN_PX 40 /* of the views that `sum` is of */
#define LOOK_READABLE_PX 34   /* squares in which every tag is read */

struct look {
	uint32_t pictures;
	double seconds;           /* of finding, this thread's */
	uint32_t in_sight, found; /* corners, squares over LOOK_READABLE_PX */
	uint32_t measured;        /* corners, squares over LOOK_SQUARE_MIN_PX */
	double sum;               /* of squared distances per axis, of these */
	double mean[2];           /* sums, until divided by `measured` */
	double worst_px;          /* of all */
};

/* The scene "board"; the caller destroys it. NULL: it could not be made. */
struct sim_scene *look_scene(const char *optics, uint32_t camera_count);

/* Shots 5, 5 + step, ... of one camera. Returns 0 or a negative errno. */
int look_at(struct look *look, struct corner_finder *finder, const struct sim_scene *scene,
	    uint32_t camera, uint32_t shot_count, uint32_t shot_step);
