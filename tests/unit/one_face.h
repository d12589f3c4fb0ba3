/*
 * A face of one actor in the tracker's state, and the labelling of one shot of it, for tests of the
 * steps of labelling.
 */
#pragma once

#include <string.h>

#include "track/label/label.h"

static struct layout layout;
static struct tracker_state state;
static struct labelling l;

/* All else zeros. */
static inline void wear(const struct layout_marker *markers, int count)
{
	memset(&layout, 0, sizeof(layout));
	memset(&state, 0, sizeof(state));
	memset(&l, 0, sizeof(l));
	layout.actor_count = 1;
	layout.actors[0].count = layout.marker_count = (uint32_t)count;
	memcpy(layout.markers, markers, (size_t)count * sizeof(*markers));
	predict_init(&state, &layout);
}
