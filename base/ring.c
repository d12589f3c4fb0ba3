/*
 * Head and tail run freely and wrap; their difference is the fill. Release/acquire pairs order
 * the item's bytes with the index that shows them.
 */
#include "base/ring.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/realtime.h"

int ring_init(struct ring *ring, size_t item_bytes, uint32_t capacity)
{
	uint32_t rounded = 1;

	memset(ring, 0, sizeof(*ring));
	while (rounded < capacity)
		rounded *= 2;
	ring->items = calloc(rounded, item_bytes);
	if (!ring->items)
		return -ENOMEM;
	realtime_touch(ring->items, item_bytes * rounded);
	ring->item_bytes = item_bytes;
	ring->capacity = rounded;
	return 0;
}

void ring_finish(struct ring *ring)
{
	free(ring->items);
	memset(ring, 0, sizeof(*ring));
}

static void *slot(struct ring *ring, uint32_t index)
{
	return ring->items + (index & (ring->capacity - 1)) * ring->item_bytes;
}

void *ring_claim(struct ring *ring)
{
	uint32_t head = atomic_load_explicit(&ring->head, memory_order_relaxed);
	uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);

	if (head - tail == ring->capacity) {
		atomic_fetch_add_explicit(&ring->refused_count, 1, memory_order_relaxed);
		return NULL;
	}
	return slot(ring, head);
}

void ring_publish(struct ring *ring)
{
	uint32_t head = atomic_load_explicit(&ring->head, memory_order_relaxed);
	uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);

	if (head + 1 - tail > atomic_load_explicit(&ring->fill_max, memory_order_relaxed))
		atomic_store_explicit(&ring->fill_max, head + 1 - tail, memory_order_relaxed);
	atomic_store_explicit(&ring->head, head + 1, memory_order_release);
}

void *ring_peek(struct ring *ring, uint32_t ahead)
{
	uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
	uint32_t head = atomic_load_explicit(&ring->head, memory_order_acquire);

	return head - tail > ahead ? slot(ring, tail + ahead) : NULL;
}

void ring_pop(struct ring *ring)
{
	uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);

	atomic_store_explicit(&ring->tail, tail + 1, memory_order_release);
}

uint32_t ring_count(const struct ring *ring)
{
	uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);

	return atomic_load_explicit(&ring->head, memory_order_acquire) - tail;
}

uint32_t ring_fill_max(const struct ring *ring)
{
	return atomic_load_explicit(&ring->fill_max, memory_order_relaxed);
}

void ring_clear(struct ring *ring)
{
	atomic_store(&ring->tail, atomic_load(&ring->head));
	atomic_store(&ring->fill_max, 0);
	atomic_store(&ring->refused_count, 0);
}
