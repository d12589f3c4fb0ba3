/*
 * Parts of a camera's image in which spots do not count: lamps, windows, other cameras' strobes.
 */
#pragma once

#include "track/observe.h"

#define MASK_AREA_MAX 16

/* Pixels x .. x + width - 1, y .. y + height - 1. */
struct mask_area {
	int x_px, y_px, width_px, height_px;
};

struct mask {
	uint32_t area_count;
	struct mask_area areas[MASK_AREA_MAX];
};

/* Takes the blobs whose middle lies in an area out of the set, the others keep their order; returns
 * how many it took. Real-time safe. */
uint32_t mask_apply(const struct mask *mask, struct blob_set *set);
