/*
 * mrcal's optimiser in a child process: it ends in time whatever it meets, and two solves run side
 * by side. Only calib/ includes this.
 */
#pragma once

#include <sys/types.h>

#include "calib/solve/problem.h"

enum stages {
	STAGES_ALL,   /* geometry, + lens cores, + lenses, + warp and outliers */
	STAGES_LAST,  /* only the last of these: from a solution that is near */
	STAGES_POSES, /* board poses alone: how well do cameras suit views they were not made from?
		       */
};

/* Returns 0 or a negative errno. Every start needs its wait; the problem stays where it is. */
int stages_start(pid_t *child, struct problem *problem, enum stages stages, double seconds_max);

/* Returns 0 when the problem's block holds a solution, -ETIMEDOUT, -EINVAL when the library failed,
 * or another negative errno; each with its message. */
int stages_wait(pid_t child, const struct problem *problem, double seconds_max, struct diag *diag);
