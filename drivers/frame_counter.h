/*
 * GigE Vision counts frames in 16 bits, from 65535 on to 1 (0 means nothing); newer devices count
 * in 64. One counter that never wraps, in which a gap of n is n lost frames.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Zero it before the first frame. */
struct frame_counter {
	bool started;
	uint64_t last_id;
	uint64_t sequence;
};

#define FRAME_ID_NARROW_MAX UINT64_C(65535)

/* The id of the next frame in, its place in the sequence out. The first is its own id. */
static inline uint64_t frame_counter_extend(struct frame_counter *counter, uint64_t id)
{
	uint64_t step = id - counter->last_id;

	if (!counter->started)
		step = id;
	else if (id < counter->last_id && counter->last_id <= FRAME_ID_NARROW_MAX)
		step = FRAME_ID_NARROW_MAX - counter->last_id + id;
	else if (id < counter->last_id)
		step = 1; /* a 64-bit counter that went back was started anew */
	counter->started = true;
	counter->last_id = id;
	counter->sequence += step;
	return counter->sequence;
}
