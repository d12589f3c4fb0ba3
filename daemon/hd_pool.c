/*
 * Every slot has one word: how many hold it, or that it is being written. The writer takes a slot
 * only from "nobody", a reader only from "not being written"; what a slot holds is looked at only
 * between taking it and letting it go.
 */
#include "daemon/hd_pool.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define HD_SLOT_WRITING (-1)

static struct hd_slot *slot_of(const struct hd_frame *frame)
{
	return (struct hd_slot *)((uintptr_t)frame - offsetof(struct hd_slot, frame));
}

int hd_pool_init(struct hd_pool *pool, uint32_t slot_count, size_t slot_bytes)
{
	memset(pool, 0, sizeof(*pool));
	if (slot_count == 0 || slot_count > HD_POOL_SLOTS_MAX || slot_bytes == 0)
		return -EINVAL;
	size_t stride = (slot_bytes + 4095) / 4096 * 4096; /* what O_DIRECT will want */

	pool->memory = aligned_alloc(4096, slot_count * stride);
	if (!pool->memory)
		return -ENOMEM;
	memset(pool->memory, 0, slot_count * stride);
	for (uint32_t i = 0; i < slot_count; i++)
		pool->slots[i].frame.pixels = pool->memory + i * stride;
	pool->slot_count = slot_count;
	pool->slot_bytes = slot_bytes;
	pool->next_seq = 1;
	return 0;
}

void hd_pool_finish(struct hd_pool *pool)
{
	free(pool->memory);
	memset(pool, 0, sizeof(*pool));
}

/* In a ring, the next slot has the oldest frame; past those that are held. */
struct hd_frame *hd_pool_claim(struct hd_pool *pool)
{
	for (uint32_t i = 0; i < pool->slot_count; i++) {
		uint32_t at = (pool->next_slot + i) % pool->slot_count;
		struct hd_slot *slot = &pool->slots[at];
		int32_t nobody = 0;

		if (!atomic_compare_exchange_strong_explicit(&slot->holds, &nobody, HD_SLOT_WRITING,
							     memory_order_acquire,
							     memory_order_relaxed))
			continue;
		pool->next_slot = (at + 1) % pool->slot_count;
		atomic_store_explicit(&slot->seq, 0, memory_order_relaxed);
		return &slot->frame;
	}
	return NULL;
}

void hd_pool_publish(struct hd_pool *pool, struct hd_frame *frame)
{
	assert(frame->size_bytes <= pool->slot_bytes);
	uint64_t seq = pool->next_seq++;

	frame->seq = seq;
	atomic_store_explicit(&slot_of(frame)->seq, seq, memory_order_relaxed);
	atomic_store_explicit(&slot_of(frame)->holds, 0, memory_order_release);
	atomic_store_explicit(&pool->newest_seq, seq, memory_order_release);
}

uint64_t hd_pool_newest(const struct hd_pool *pool)
{
	return atomic_load_explicit(&pool->newest_seq, memory_order_acquire);
}

/* False when the writer has it. */
static bool hold_slot(struct hd_slot *slot)
{
	int32_t holds = atomic_load_explicit(&slot->holds, memory_order_relaxed);

	while (holds != HD_SLOT_WRITING)
		if (atomic_compare_exchange_weak_explicit(&slot->holds, &holds, holds + 1,
							  memory_order_acquire,
							  memory_order_relaxed))
			return true;
	return false;
}

void hd_pool_release(const struct hd_frame *frame)
{
	int32_t holds = atomic_fetch_sub_explicit(&slot_of(frame)->holds, 1, memory_order_release);

	assert(holds > 0);
	(void)holds;
}

static struct hd_slot *hold(struct hd_pool *pool, uint64_t seq)
{
	for (uint32_t i = 0; i < pool->slot_count && seq > 0; i++) {
		struct hd_slot *slot = &pool->slots[i];

		if (atomic_load_explicit(&slot->seq, memory_order_relaxed) != seq ||
		    !hold_slot(slot))
			continue;
		if (slot->frame.seq == seq)
			return slot;
		hd_pool_release(&slot->frame);
	}
	return NULL;
}

const struct hd_frame *hd_pool_hold(struct hd_pool *pool, uint64_t seq)
{
	struct hd_slot *slot = hold(pool, seq);

	return slot ? &slot->frame : NULL;
}

void hd_pool_set_shot(struct hd_pool *pool, uint64_t seq, uint64_t shot)
{
	struct hd_slot *slot = hold(pool, seq);

	if (!slot)
		return;
	atomic_store_explicit(&slot->frame.shot, shot, memory_order_relaxed);
	hd_pool_release(&slot->frame);
}
