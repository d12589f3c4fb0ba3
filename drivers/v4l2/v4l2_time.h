/*
 * From the time stamp on a buffer to the middle of the exposure. What the stamp marks is in the
 * buffer's flags (kernel documentation, V4L2 "Timestamp" flags); what lies between that and the
 * light is known, or has bounds. Whether a stream's stamps are believed is settled in its first
 * frames, once. Pure; real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define V4L2_TIME_FRAMES 16 /* in which a stream's stamps are tried */

/* Of a stream; v4l2_time_begin() when it begins anew. */
struct v4l2_timing {
	int64_t begin_ns;    /* CLOCK_MONOTONIC when it began */
	int64_t period_ns;   /* 0: not known */
	int64_t exposure_ns; /* 0: not known */
	int64_t readout_ns;  /* 0: not known */
	/* what the driver calls the start of the exposure is when the first of the picture's bytes
	 * came to the host: uvcvideo without hardware time stamps */
	bool stamps_first_bytes;
	/* rows may be exposed one after the other; from the first to the last, 0: not known: then
	 * the time is that of the first, and the bound allows for the middle one's */
	bool may_roll;
	int64_t rows_ns;

	/* of v4l2_time() */
	uint32_t tried;      /* frames, up to V4L2_TIME_FRAMES */
	bool disbelieved;    /* one of those lied: the stream's times are bounded by arrival */
	bool any;            /* ... frame so far; the last one's exposure was: */
	int64_t last_ns;     /* told */
	int64_t last_low_ns; /* surely not before */
};

/* Of a buffer. */
struct v4l2_stamp {
	uint32_t flags;          /* v4l2_buffer.flags */
	int64_t stamp_ns;        /* v4l2_buffer.timestamp */
	int64_t not_yet_ns;      /* CLOCK_MONOTONIC at which the picture was surely not ready */
	int64_t arrival_ns;      /* ... and at which it was handed out */
	int64_t mid_exposure_ns; /* result, after the last frame's, not after arrival_ns */
	int64_t uncertainty_ns;  /* result, a bound */
};

void v4l2_time_begin(struct v4l2_timing *timing, int64_t begin_ns);

/* Frames in the order in which they were exposed. */
void v4l2_time(struct v4l2_timing *timing, struct v4l2_stamp *stamp);
