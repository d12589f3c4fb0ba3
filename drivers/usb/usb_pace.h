/*
 * When the samples of a USB adapter are on its lines, and how many of them a shot must have so that
 * shots keep to CLOCK_MONOTONIC whatever the adapter's quartz does. All that is known of its clock
 * is when it took samples; their lower envelope (clock_map.h) tells the rest. Pure; one thread.
 */
#pragma once

#include "drivers/clock_map.h"
#include "drivers/usb/usb_wave.h"

struct usb_pace {
	/* of the stream */
	uint32_t divisor, period, slack;
	int64_t period_ns;
	int64_t first_sample;               /* samples are numbered on from stream to stream */
	int64_t origin_ns;                  /* the adapter's clock at its beginning */
	int64_t opened_ns, opened_bound_ns; /* CLOCK_MONOTONIC of that */
	struct clock_map map;
	uint32_t late_count; /* readings in a row that came too late */
	int64_t late_from_ns;
	/* the next shot */
	uint64_t shot;
	int64_t shot_sample; /* its sample 0 */
	int64_t due_ns;      /* CLOCK_MONOTONIC when it should be on the lines; 0: no shot yet */
};

/* A stream begins on an adapter that had no samples left: `first_sample` was put out between two
 * readings of the clock. A zeroed pace is the first; later streams go on with its shots. */
void usb_pace_begin(struct usb_pace *pace, const struct usb_wave *wave, int64_t period_ns,
		    int64_t first_sample, int64_t before_ns, int64_t after_ns);

/* The next shot is the first whose time has not passed by `sample`; the very first is there. */
void usb_pace_seek(struct usb_pace *pace, int64_t sample);

/* How many samples the next shot has, so that the one behind it is on time; goes on to that. */
uint32_t usb_pace_advance(struct usb_pace *pace);

/* At `host_ns`, or a little before, the adapter took the end of a run of whole packets that its
 * memory cannot hold at once. False: for a while all were late, so its lines stood still once. */
bool usb_pace_taken(struct usb_pace *pace, int64_t end_sample, int64_t host_ns);

/* By the adapter's clock, and when that is by CLOCK_MONOTONIC with a bound on its error. */
int64_t usb_pace_device_ns(const struct usb_pace *pace, int64_t sample);
int64_t usb_pace_host_ns(struct usb_pace *pace, int64_t sample, int64_t *uncertainty_ns);
