/*
 * The frames of one HD camera, each copied once into a slot of fixed memory. The capture thread
 * writes; any number of slow readers (preview, a recorder) hold the slots that they read. A slot
 * that is held is never written, so that no frame is ever torn, and the newest frame is refused
 * when all slots are held: the writer waits for nobody and nobody waits for the writer.
 */
#pragma once

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/camera.h"

#define HD_POOL_SLOTS_MAX 64

struct hd_frame {
	uint64_t seq;          /* of the frames kept in this pool, from 1, without gaps */
	_Atomic uint64_t shot; /* SHOT_UNKNOWN until the solver has placed the frame */
	int width_px, height_px;
	enum pixel_format format;
	size_t size_bytes;
	int64_t mid_exposure_ns; /* of the middle row */
	int64_t uncertainty_ns;
	int64_t arrival_ns;
	int64_t row_time_ns;
	uint8_t *pixels; /* rows without padding; the pool's */
};

struct hd_slot {
	_Atomic int32_t holds; /* readers; -1: the writer has it */
	_Atomic uint64_t seq;  /* of the frame: where to look for it, not that it is there */
	struct hd_frame frame;
};

struct hd_pool {
	/* set when made */
	uint32_t slot_count;
	size_t slot_bytes;
	uint8_t *memory; /* owned */
	/* writer */
	uint32_t next_slot;
	uint64_t next_seq;

	_Atomic uint64_t newest_seq; /* 0 = none yet */
	struct hd_slot slots[HD_POOL_SLOTS_MAX];
};

/* All memory is touched. Returns 0, -EINVAL (no slots, or too many) or -ENOMEM. */
int hd_pool_init(struct hd_pool *pool, uint32_t slot_count, size_t slot_bytes);
void hd_pool_finish(struct hd_pool *pool); /* a zeroed pool is fine */

/* Writer. The slot to fill and then publish, of the oldest frame that nobody holds; NULL when all
 * are held. Real-time safe. */
struct hd_frame *hd_pool_claim(struct hd_pool *pool);
void hd_pool_publish(struct hd_pool *pool, struct hd_frame *frame); /* numbers it */

/* Any thread. The number of the newest frame; 0 before the first. */
uint64_t hd_pool_newest(const struct hd_pool *pool);

/* Any thread. Frame `seq`, unchanged until it is released; NULL when it is overwritten or not there
 * yet. Real-time safe. */
const struct hd_frame *hd_pool_hold(struct hd_pool *pool, uint64_t seq);
void hd_pool_release(const struct hd_frame *frame);

/* Any one thread: gives frame `seq` its shot, if it is still there. Real-time safe. */
void hd_pool_set_shot(struct hd_pool *pool, uint64_t seq, uint64_t shot);
