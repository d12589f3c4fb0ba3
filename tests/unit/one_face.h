/*
 * A face of one actor in the tracker's state, and the labelling of one shot of it, for tests of the
 * steps of labelling. The face is found, with the head's axes being the stage's.
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
	l.found[0] = true;
	l.rt_stage_frame[0] = l.rt_frame_stage[0] = POSE_IDENTITY;
}

#define CHEEK_SPACING_M 0.01

enum { CHEEK_SIDE = 3, CHEEK_COUNT = CHEEK_SIDE * CHEEK_SIDE, CHEEK_MIDDLE = CHEEK_COUNT / 2 };

/* Nine markers in a square. */
static inline void wear_cheek(void)
{
	struct layout_marker markers[CHEEK_COUNT];

	for (int i = 0; i < CHEEK_COUNT; i++)
		markers[i] = (struct layout_marker){
			.group = "cheek",
			.neutral_m = {CHEEK_SPACING_M * (i % CHEEK_SIDE),
				      CHEEK_SPACING_M * (i / CHEEK_SIDE), 0.1}};
	wear(markers, CHEEK_COUNT);
}
