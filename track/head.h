/*
 * Where a frame is - a head, or a segment of a body: predicted from its last motion, found again
 * among the shot's points before any name is given, and at last fitted to the named markers. Pure
 * and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/match/match.h"
#include "track/match/nearby.h"
#include "track/predict.h"
#include "track/tracker_state.h"

/* Where the frame should be at `now_ns`, at constant velocity. */
struct pose head_predict(const struct frame_state *frame, int64_t now_ns);

/* Moves `pose` so that the frame's predicted markers fall on points nearby; robust against those
 * that have none or the wrong one. False when too few agree. */
bool head_refine(const struct tracker_state *state, int frame,
		 const struct predictions *predictions, const struct nearby *nearby,
		 struct pose *pose);

/* The pose from the frame's named points (point_of_label[i], or -1), `guess` being near it. Of a
 * head: the rigid markers where three are seen, else the resting places of the skin hold it too.
 * `out->valid` says whether it could be had. */
void head_fit(const struct tracker_state *state, int frame, const struct point *points,
	      const int16_t *point_of_label, const struct pose *guess, struct head *out);

/* How far apart two poses put the face. */
double head_distance_m(const struct pose *a, const struct pose *b);

/* Stores the measured pose and the velocity that follows from it. */
void head_update(struct frame_state *frame, const struct pose *pose, int64_t now_ns);
