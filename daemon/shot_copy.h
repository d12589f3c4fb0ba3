/*
 * A copy of one solved shot, spots and markers, for whoever asks over the control socket. One slot:
 * all who wait get the same shot.
 */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>

#include "track/observe.h"

enum shot_copy_state { SHOT_COPY_NONE, SHOT_COPY_WANTED, SHOT_COPY_READY };

/* Large: part of the station. */
struct shot_copy {
	_Atomic int state; /* solver thread: WANTED to READY; control thread: all else */
	uint32_t present_mask;
	struct blob_set sets[CAMERA_MAX];
	struct marker_set set;
};

/* Control thread. */
void shot_copy_request(struct shot_copy *copy);
bool shot_copy_ready(const struct shot_copy *copy);
void shot_copy_done(struct shot_copy *copy); /* nobody reads it any more */

/* Solver thread, real-time safe. Does nothing unless somebody waits. */
void shot_copy_take(struct shot_copy *copy, const struct shot *shot, const struct marker_set *set);
