/*
 * Which frames belong together. Each camera delivers its frames in order; sync looks only at the
 * front of each queue and says which fronts make the next shot. The live solver and the offline
 * `process` ask the same function.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/observe.h"

enum front_state {
	FRONT_WAITING, /* nothing queued yet, more may come */
	FRONT_READY,   /* the time and shot fields are valid */
	FRONT_ENDED,   /* the camera is gone, or its recording is over */
};

struct front {
	enum front_state state;
	uint64_t shot; /* as the source or the ledger numbers it; else SHOT_UNKNOWN */
	int64_t mid_exposure_ns;
};

/* Flat, so that a take can store it. Zero it, then set period_ns when it is known. */
struct sync {
	int64_t period_ns;   /* 0 = learned from the gaps between shots */
	bool period_learned; /* set by sync: then up to 2 ms, not half a period, make one shot */
	bool started;
	uint64_t last_shot;
	int64_t last_mid_exposure_ns;
};

struct sync_decision {
	uint64_t shot;
	int64_t mid_exposure_ns; /* mean over the members whose times agree; of the edge when there
				    are none */
	uint32_t member_mask;    /* fronts that make this shot: consume them */
	uint32_t off_time_mask;  /* members by their number that were exposed, by their time, more
				    than half a period from the others */
	uint32_t missing_mask;   /* cameras that have no frame in it */
	uint32_t stale_mask;     /* fronts older than shots already closed: drop and count them */
	bool edge_used;          /* the edge is this shot's, or (SYNC_STALE) too old: consume it */
};

enum sync_result {
	SYNC_WAIT,  /* a camera (or the edge) may still come */
	SYNC_SHOT,  /* the decision holds a shot; member_mask may be 0: every camera missed it */
	SYNC_STALE, /* no shot, only stale fronts to drop; ask again */
	SYNC_END,   /* every camera has ended */
};

/*
 * `edge` is the trigger's next pulse (its shot number and the mid-exposure it asks for), or NULL
 * when nothing reports edges: then shots are made from the frames alone, by their own shot numbers
 * where they have them, else mid-exposures within half a period are one shot, and a gap of n
 * periods moves the shot number by n. An edge that is FRONT_WAITING is waited for; one that is
 * FRONT_ENDED (the trigger is gone) counts as NULL. `expired`: the deadline of the oldest front or
 * edge has passed; wait for nobody. Every call consumes an edge or a front, or says to wait, or
 * that all is over.
 */
enum sync_result sync_next(struct sync *sync, const struct front *fronts, uint32_t camera_count,
			   const struct front *edge, bool expired, struct sync_decision *out);
