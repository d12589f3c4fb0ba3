/*
 * Maps a device's clock to CLOCK_MONOTONIC from one-sided samples: a message stamped by the device
 * at `device_ns` was in host memory at `host_ns`, never earlier than it was sent. The earliest
 * messages lie on a line whose slope is the drift: the lower envelope (Moon, Skelly and Towsley,
 * "Estimation and removal of clock skew from network delay measurements", 1999). Pure; any thread.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define CLOCK_MAP_BINS 32 /* of half a second: the window is 16 s */

/* The earliest message of one bin. */
struct clock_map_point {
	int64_t device_ns;
	int64_t delay_ns; /* host - device */
};

/* Zero it, set path_bound_ns; nothing else is the caller's. */
struct clock_map {
	int64_t path_ns;       /* how long the fastest message travels, as far as known */
	int64_t path_bound_ns; /* bound on the error of that */
	uint32_t count;        /* points used, oldest first */
	struct clock_map_point points[CLOCK_MAP_BINS];
	uint64_t samples; /* since the last reset */
	uint64_t resets;  /* steps of the device's clock, counted */
	/* the line: delay = base_delay_ns + drift * (device - base_device_ns) */
	int64_t base_device_ns, base_delay_ns;
	double drift;
	double residual_ns; /* median height of the points above the line */
	/* the two-sided reading, until the window has moved past it */
	bool anchored;
	struct clock_map_point anchor;
	int64_t anchor_bound_ns;
	int64_t last_device_ns, last_host_ns; /* latest answer, for monotone use */
};

/* A two-sided reading: when the device's clock showed `device_ns` the host's was within bound_ns of
 * `host_ns`. To be given before the first sample; it makes the first answers good and teaches how
 * long the fastest message travels. */
void clock_map_anchor(struct clock_map *map, int64_t device_ns, int64_t host_ns, int64_t bound_ns);

/* A sample; device times must rise. A device clock that steps starts the map anew. */
void clock_map_sample(struct clock_map *map, int64_t device_ns, int64_t host_ns);

/* CLOCK_MONOTONIC at `device_ns`, and a bound on its error. Needs one sample. Answers rise when the
 * questions do, whatever later samples teach. */
int64_t clock_map_host_ns(struct clock_map *map, int64_t device_ns, int64_t *uncertainty_ns);
