/*
 * A rig that was made anew has a frame of its own: the first second of markers tells how it lies in
 * the scene. Only after that is anything judged.
 */
#pragma once

#include "demo/referee.h"
#include "track/rigid.h"

#define ALIGN_PAIRS 8000

struct align {
	uint32_t sets;
	int count;
	bool done;
	struct rigid_pair pairs[ALIGN_PAIRS];
};

/* Takes one set; when it is enough, the referee is told. The referee knows the labels. */
void align_take(struct align *align, struct referee *referee, const struct stage_marker_set *set);
