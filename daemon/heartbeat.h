/*
 * Whether the real-time threads are alive. Each moves its heartbeat once per turn of its loop,
 * which waits 0.1 s at most; the control thread watches. A thread that hangs in a driver or spins
 * is told from one that merely has nothing to do.
 */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/clock.h"

#define HEARTBEAT_LATE_NS NS_PER_S /* ten waits: what stands still for longer is named */

struct heartbeat {
	/* only its thread stores them */
	_Atomic uint64_t beats;
	_Atomic bool over; /* it left its loop by itself and beats no more */
	/* control thread */
	bool expected; /* its thread runs */
	uint64_t seen_beats, kicked_beats;
	int64_t moved_ns; /* when seen_beats last changed */
};

/* Its own thread. Real-time safe. */
static inline void heartbeat_beat(struct heartbeat *heartbeat)
{
	atomic_fetch_add_explicit(&heartbeat->beats, 1, memory_order_relaxed);
}

/* Its own thread, last. */
static inline void heartbeat_end(struct heartbeat *heartbeat)
{
	atomic_store_explicit(&heartbeat->over, true, memory_order_relaxed);
}

/* Control thread, before the thread starts and after it was joined. */
void heartbeat_expect(struct heartbeat *heartbeat, int64_t now_ns);
void heartbeat_forget(struct heartbeat *heartbeat);

/* Control thread, more often than HEARTBEAT_LATE_NS: how long it has stood still; 0 when it moved,
 * or when no thread is to move it. */
int64_t heartbeat_still_ns(struct heartbeat *heartbeat, int64_t now_ns);

/* Control thread, for the watchdog alone: whether it moved since the last heartbeat_kicked(). One
 * that nobody is to move never holds the watchdog up. */
bool heartbeat_moved(const struct heartbeat *heartbeat);
void heartbeat_kicked(struct heartbeat *heartbeat);
