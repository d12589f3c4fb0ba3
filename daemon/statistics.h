/*
 * Rates of the last second and latencies of each stage of the work, from the counters that the
 * real-time threads keep and the times that marker sets bear. In fixed memory. Control thread only.
 */
#pragma once

#include "base/histogram.h"
#include "daemon/capture.h"
#include "track/observe.h"

struct camera_rate {
	uint64_t frames_before, blobs_before;
	double frames_per_s;
	double blobs_per_frame;
};

/* From one moment in the life of a shot to another; light is the middle of the exposure, arrival
 * the last camera's last pixel in memory. */
enum latency_stage {
	LATENCY_LIGHT_TO_ARRIVAL,
	LATENCY_ARRIVAL_TO_BLOBS,
	LATENCY_BLOBS_TO_SOLVED,
	LATENCY_SOLVED_TO_SENT,
	LATENCY_ARRIVAL_TO_SENT, /* the station's own part */
	LATENCY_LIGHT_TO_SENT,
	LATENCY_STAGE_COUNT,
};

const char *latency_stage_name(enum latency_stage stage);

#define LATENCY_RECENT_S 10 /* "recent" is the last 10 to 20 s */

struct latency {
	struct histogram run;    /* since the start */
	struct histogram recent; /* since the last change of window */
	struct histogram before; /* the window before */
};

struct statistics {
	int64_t last_ns, window_ns;
	uint64_t shots_before;
	double shots_per_s;
	struct camera_rate cameras[CAMERA_MAX];
	struct latency latencies[LATENCY_STAGE_COUNT];
};

/* When it was handed to the subscribers. */
void statistics_add_set(struct statistics *statistics, const struct marker_set *set,
			int64_t sent_ns);

/* Once a second. */
void statistics_update(struct statistics *statistics, const struct capture *captures,
		       uint32_t count, uint64_t shots, int64_t now_ns);

/* The two windows together. */
void latency_recent(const struct latency *latency, struct histogram *out);
