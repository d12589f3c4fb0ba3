/*
 * Rates and latencies of the last seconds, from the counters that the real-time threads keep.
 * Control thread only.
 */
#pragma once

#include "daemon/capture.h"
#include "track/observe.h"

#define LATENCY_WINDOW 512

struct camera_rate {
	uint64_t frames_before, blobs_before;
	double frames_per_s;
	double blobs_per_frame;
};

struct statistics {
	int64_t last_ns;
	uint64_t shots_before;
	double shots_per_s;
	struct camera_rate cameras[CAMERA_MAX];
	int64_t latency_ns[LATENCY_WINDOW]; /* last pixel in memory -> solved */
	uint64_t latency_count;             /* of all so far; the window holds the last ones */
};

void statistics_add_set(struct statistics *statistics, const struct marker_set *set);

/* Once a second. */
void statistics_update(struct statistics *statistics, const struct capture *captures,
		       uint32_t count, uint64_t shots, int64_t now_ns);

/* Of the window, `part` 0..1; 0 while it is empty. */
int64_t statistics_latency_ns(const struct statistics *statistics, double part);
