/*
 * What one shot leaves behind for the next: names given, withheld and taken back, where each marker
 * is and how it moves. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

/* Labels without a point: is there one that only two cameras see? */
void remember_two_camera(struct labelling *labelling, const struct tracker_state *state,
			 struct matcher *matcher);

/* Updates the labels of all found frames, whose final poses are in `labelling`, and names the
 * points. `anchored` says of which heads three rigid markers are seen. */
void remember_labels(struct labelling *labelling, struct tracker_state *state, struct point *points,
		     const bool *anchored, int64_t now_ns, double dt_s);

/* A frame that is lost for long: its markers are as if never seen. */
void remember_nothing(struct tracker_state *state, int frame);
