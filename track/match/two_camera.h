/*
 * Markers that only two cameras see: whether such a point is a label's. Solve thread.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/label/label.h"
#include "track/match/match.h"

/* Whether the point has a camera that did not see the label lately: it shows another marker, or a
 * stray light. */
bool two_camera_joins_in(const struct labelling *labelling, const struct tracker_state *state,
			 uint32_t label, const struct point *point);

/* Whether a point of two cameras, which lies at `local_m` in the label's frame, is its marker. */
bool two_camera_is_it(const struct labelling *labelling, const struct tracker_state *state,
		      const struct matcher *matcher, uint32_t label, const struct point *point,
		      struct vec3 local_m);
