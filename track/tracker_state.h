/*
 * Everything the tracker carries from one shot to the next: flat, no pointers, the same bytes after
 * the same shots.
 */
#pragma once

#include <stdint.h>

#include "track/observe.h"

struct tracker_state {
	int64_t mid_exposure_ns; /* of the last shot */
};
