/*
 * Between queues of blob sets, sync and the tracker: the front of a queue, and the shot that a
 * decision makes of the fronts. Pure.
 */
#pragma once

#include "track/observe.h"
#include "track/sync/sync.h"

/* `set` is the oldest of the queue, or NULL when it is empty; `ended`: nothing more will come. */
struct front front_of_queue(const struct blob_set *set, bool ended);

/* The shot of `decision`, of the oldest set of each queue. Cameras outside `tracked_mask` count
 * neither as present nor as missing. The sets are borrowed. */
void shot_gather(struct shot *shot, const struct sync_decision *decision,
		 const struct blob_set *const sets[CAMERA_MAX], uint32_t camera_count,
		 uint32_t tracked_mask);
