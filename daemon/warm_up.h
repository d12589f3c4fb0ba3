/*
 * Free-running cameras start one after the other. Until each has sent a frame of the same moment
 * there are no shots yet: older frames are dropped and counted. A camera that stays dark is given
 * up after a second, and shots are made without it.
 */
#pragma once

#include <stdint.h>

#include "daemon/capture.h"

struct warm_up {
	bool done;
	int64_t begin_ns; /* when the first frame was there; 0 = none yet */
};

/* Solver thread. False while there are no shots yet; ask again when something comes, at the latest
 * after a tenth of a second. */
bool warm_up_step(struct warm_up *warm_up, struct capture *captures, uint32_t count,
		  int64_t period_ns, int64_t now_ns);
