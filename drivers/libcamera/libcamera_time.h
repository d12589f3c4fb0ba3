/*
 * From libcamera's SensorTimestamp to the middle of the exposure. libcamera says that it is when
 * the first row began to be exposed; what drivers stamp is the beginning of the read-out, which is
 * the end of that exposure, or the end of the frame. Which it is shows in how long before the
 * picture's arrival it lies, as far as it shows; the rest is uncertainty. Pure; real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define LIBCAMERA_TIME_FRAMES 16 /* in which it is settled what a stream's stamps mark */

/* Of a stream; libcamera_time_begin() when it begins anew. */
struct libcamera_timing {
	int64_t period_ns;      /* 0: not known */
	int64_t exposure_ns;    /* 0: not known */
	int64_t readout_ns;     /* of the whole picture; 0: not known */
	int64_t rows_ns;        /* from the first row to the last, of a rolling shutter */
	bool may_roll;          /* nobody tells which it has */
	int64_t boot_offset_ns; /* CLOCK_BOOTTIME less CLOCK_MONOTONIC: stamps may be of either */

	/* of libcamera_time() */
	int64_t begin_ns;
	uint32_t tried;       /* frames, up to LIBCAMERA_TIME_FRAMES */
	int64_t least_lag_ns; /* from a stamp to the arrival, in those */
	bool any;             /* frame so far; the last one's exposure was: */
	int64_t last_ns;      /* told */
};

/* Of a frame. */
struct libcamera_stamp {
	int64_t stamp_ns;        /* 0: none */
	int64_t exposure_ns;     /* of this frame; 0: not told */
	int64_t arrival_ns;      /* CLOCK_MONOTONIC */
	int64_t mid_exposure_ns; /* result: of the middle row; after the last, not after arrival */
	int64_t uncertainty_ns;  /* result, a bound */
};

void libcamera_time_begin(struct libcamera_timing *timing, int64_t begin_ns);

/* Frames in the order in which they were exposed. */
void libcamera_time(struct libcamera_timing *timing, struct libcamera_stamp *stamp);
