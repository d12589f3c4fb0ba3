/*
 * What a face does, from points without names: where skin moves by a marker's distance from one
 * shot to the next, no marker tells by itself which point it is, but the face as a whole does.
 * Readings one row aside lay many markers on points, too; the one that lays more of them better is
 * taken, and the next best one says which names are not sure. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/expression.h"
#include "track/match/nearby.h"
#include "track/tracker_state.h"

struct expression_search {
	bool known;
	struct expression expression;
	int16_t point_of_label[LABEL_MAX]; /* or -1: none, or another reading is nearly as good and
					      has another one */
};

/* Searches about the last expression, farthest along the pattern that moves most. */
void expression_search(const struct tracker_state *state, int actor, int64_t now_ns,
		       const struct nearby *nearby, const struct pose *rt_stage_head,
		       struct expression_search *out);
