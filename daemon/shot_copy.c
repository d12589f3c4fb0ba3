/*
 * The state says whose the slot is.
 */
#include "daemon/shot_copy.h"

#include <stddef.h>
#include <string.h>

void shot_copy_request(struct shot_copy *copy)
{
	int none = SHOT_COPY_NONE;

	atomic_compare_exchange_strong(&copy->state, &none, SHOT_COPY_WANTED);
}

bool shot_copy_ready(const struct shot_copy *copy)
{
	return atomic_load_explicit(&copy->state, memory_order_acquire) == SHOT_COPY_READY;
}

void shot_copy_done(struct shot_copy *copy)
{
	atomic_store(&copy->state, SHOT_COPY_NONE);
}

static void copy_blobs(struct blob_set *to, const struct blob_set *from)
{
	memcpy(to, from, offsetof(struct blob_set, blobs));
	memcpy(to->blobs, from->blobs, from->blob_count * sizeof(*from->blobs));
}

void shot_copy_take(struct shot_copy *copy, const struct shot *shot, const struct marker_set *set)
{
	if (atomic_load_explicit(&copy->state, memory_order_acquire) != SHOT_COPY_WANTED)
		return;
	copy->present_mask = 0;
	for (uint32_t c = 0; c < shot->camera_count; c++)
		if (shot->sets[c]) {
			copy_blobs(&copy->sets[c], shot->sets[c]);
			copy->present_mask |= UINT32_C(1) << c;
		}
	memcpy(&copy->set, set, offsetof(struct marker_set, markers));
	memcpy(copy->set.markers, set->markers, set->marker_count * sizeof(*set->markers));
	atomic_store_explicit(&copy->state, SHOT_COPY_READY, memory_order_release);
}
