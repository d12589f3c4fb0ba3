/*
 * Where every head and every body segment is in this shot: those that were there a moment ago are
 * followed, those that are lost are searched for among the points that nobody explains. Actors wear
 * the same markers at nearly the same places, so a face that is found is given to the actor whom it
 * fits clearly best, and to nobody while two fit alike. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/acquire.h"
#include "track/label/label.h"

struct crowd {
	struct acquire_scratch acquire;
	bool taken[POINT_MAX];
};

/* Fills found and rt_stage_frame in `labelling`, whose motion and nearby are filled.
 * Poses of frames that are not found are predictions. */
void crowd_find(struct crowd *crowd, struct tracker_state *state, struct labelling *labelling,
		const struct point *points, uint32_t point_count, int64_t now_ns);

/* Skin alone holds this head: from time to time the stage is searched for a better place. Returns
 * false when there is one: then the head is elsewhere. */
bool crowd_doubt(struct crowd *crowd, struct tracker_state *state, struct labelling *labelling,
		 const struct point *points, uint32_t point_count, int frame,
		 const struct head *measured);
