/*
 * Where the segments of a body are: rigid, with few markers each, followed by their own motion and
 * searched for about the head of their actor. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

/* Moves the segment's predicted pose in `labelling` onto the points that nobody has taken. False
 * when none of its markers is there. */
bool segment_follow(const struct tracker_state *state, struct labelling *labelling, int frame,
		    const bool *taken);

/* Looks for a segment among the points about its actor's head, which is found; fills its pose.
 * False when no more than `held` of its markers are there, or when it could be in two ways. */
bool segment_search(struct tracker_state *state, struct labelling *labelling, int frame,
		    const bool *taken, int held);

/* The pose from the segment's named points, near the one in `labelling`. Takes away the names that
 * do not fit the others: a segment is rigid. */
void segment_fit(const struct tracker_state *state, struct labelling *labelling, int frame,
		 const struct point *points, struct head *out);
