/*
 * Ready-made frames of one camera, more of them (over all cameras) than the last-level cache holds,
 * and the instants at which they are "in memory": the same multiples of the period for every camera
 * and process, so that nobody has to tell anybody.
 */
#pragma once

#include <stdint.h>

#define POOL_PERIOD_NS INT64_C(8333333)
#define POOL_CAMERAS 8

struct frame_pool {
	int width_px, height_px;
	int frame_count;
	uint8_t *pixels; /* owned; frames one after the other */
};

/* Renders the frames: the talking scene in steps of a millisecond, forth and back, so that motion
 * never jumps. Returns 0 or a negative errno. */
int frame_pool_init(struct frame_pool *pool, uint64_t seed, uint32_t camera);
void frame_pool_finish(struct frame_pool *pool);

const uint8_t *frame_pool_at(const struct frame_pool *pool, uint64_t frame);

/* Number of the first frame after `now_ns`, and when it is there. */
uint64_t frame_pool_next(int64_t now_ns, int64_t *due_ns);

/* The yardstick: plainly reading a frame, with SIMD. */
uint64_t frame_pool_sum(const struct frame_pool *pool, uint64_t frame);
