/*
 * What an HD camera has in place of blobs: a pool that its frames are copied into, and a note of
 * each to the solver, which knows the shots and gives the frame its own.
 */
#pragma once

#include "base/ring.h"
#include "daemon/hd_pool.h"
#include "track/observe.h"
#include "track/sync/sync.h"

struct shot_book;

struct hd_note {
	uint64_t pool_seq; /* 0: there was no room for it */
	uint64_t shot;     /* from the source, when it knows; else SHOT_UNKNOWN */
	uint64_t device_seq;
	int64_t mid_exposure_ns, arrival_ns;
};

struct hd_capture {
	struct hd_pool pool;
	struct ring notes; /* of hd_note, capture thread to solver */
	/* solver writes, any thread reads */
	_Atomic uint64_t last_shot; /* of the newest frame placed, or SHOT_UNKNOWN */
	_Atomic uint64_t off_phase; /* frames of shots that the plan does not expose HD in */
};

/* When the HD cameras expose. Owned by the solver thread. */
struct hd_plan {
	uint32_t camera_mask; /* 0: there is none */
	uint32_t divider, phase;
	bool phase_known;    /* no trigger: by the first frame */
	int64_t after_ir_ns; /* from a shot's IR mid-exposure to that of HD */
};

/* Room for 300 ms of frames of at most `frame_bytes`. Returns 0 or a negative errno. Control
 * thread.
 */
int hd_capture_init(struct hd_capture *hd, size_t frame_bytes, int64_t period_ns);
void hd_capture_finish(struct hd_capture *hd); /* a zeroed one is fine */

/* Drops what is queued, between two runs. */
void hd_capture_begin_run(struct hd_capture *hd);

/* Capture thread. Copies the frame; false when there is no room for it. */
bool hd_capture_keep(struct hd_capture *hd, const struct frame *frame);

/* Solver thread. Gives the frames that have come their shots, by `book` where edges are reported,
 * else (NULL) by the time since sync's last shot. One that the ledger refuses stays without; so
 * does one that came before the first shot. Returns how many those were. */
uint64_t hd_capture_place(struct hd_capture *hd, struct hd_plan *plan, const struct sync *sync,
			  struct shot_book *book, uint32_t camera);

/* Solver thread. Says in the marker set whether HD exposes in its shot. */
void hd_plan_stamp(const struct hd_plan *plan, struct marker_set *set);
