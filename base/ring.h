/*
 * Lock-free ring of fixed-size items, one producer thread and one consumer thread.
 * A full ring refuses the newest item and counts it: nothing is lost silently.
 */
#pragma once

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

struct ring {
	/* set before the threads start */
	unsigned char *items; /* owned */
	size_t item_bytes;
	uint32_t capacity; /* a power of two */

	/* atomic, any thread */
	_Atomic uint32_t head;     /* next to write; only the producer stores it */
	_Atomic uint32_t tail;     /* next to read; only the consumer stores it */
	_Atomic uint32_t fill_max; /* most items at once so far; only the producer stores it */
	_Atomic uint64_t refused_count;
};

/* Allocates and touches `capacity` items (rounded up to a power of two). Returns 0 or -ENOMEM. */
int ring_init(struct ring *ring, size_t item_bytes, uint32_t capacity);
void ring_finish(struct ring *ring);

/* Producer. The slot to fill next, or NULL (counted) when the ring is full; ring_publish() hands
 * it over. The pointer stays the producer's until then. */
void *ring_claim(struct ring *ring);
void ring_publish(struct ring *ring);

/* Consumer. The item `ahead` places behind the oldest (0 = the oldest), or NULL when there are
 * not that many; it stays valid until ring_pop() passes it. */
void *ring_peek(struct ring *ring, uint32_t ahead);
void ring_pop(struct ring *ring);

/* Any thread; a snapshot. */
uint32_t ring_count(const struct ring *ring);
uint32_t ring_fill_max(const struct ring *ring);

/* While neither thread runs: drops what is queued and counts anew. */
void ring_clear(struct ring *ring);
