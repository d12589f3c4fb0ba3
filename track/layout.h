/*
 * The markers that an actor wears: names and neutral places in head coordinates
 * (x to the subject's left, y up, z out of the face; metres).
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/observe.h"

#define NAME_BYTES 64 /* of a marker, group, camera or actor, with the NUL */

struct layout_marker {
	char name[NAME_BYTES];
	char group[NAME_BYTES];
	bool rigid; /* moves with the skull: head band, not skin */
	struct vec3 neutral_m;
	double diameter_m;
};

struct layout {
	char actor[NAME_BYTES];
	uint32_t marker_count;
	struct layout_marker markers[LABEL_MAX];
};
