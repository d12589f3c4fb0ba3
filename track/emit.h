/*
 * The marker set that a shot becomes: the labels in the layout's order, then the points without a
 * name. Pure and real-time safe.
 */
#pragma once

#include "track/label/label.h"

/* `shown[f]`: the frame's pose in `labelling` is measured, or a moment old and predicted. Fills the
 * markers and their counts, and the state's loose points. */
void emit_markers(struct tracker_state *state, const struct labelling *labelling,
		  const struct point *points, uint32_t point_count, const bool *shown,
		  struct marker_set *out);
