/*
 * An adapter whose memory is full takes a packet when there is room for it, so the end of what it
 * took is a fixed number of samples ahead of its lines. How many is of no matter: the beginning of
 * the stream, which is known from both sides, teaches the difference.
 */
#include "drivers/usb/usb_pace.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

#define AHEAD_SAMPLES (2 * USB_WAVE_FIFO_SAMPLES) /* more than the adapter holds */
#define LATE_MIN_NS (2 * NS_PER_MS)
#define LATE_SHARE 8  /* of a period */
#define LATE_COUNT 16 /* readings: a busy machine is not late every time */
#define LATE_FOR_NS (250 * NS_PER_MS)

static void open_map(struct usb_pace *pace)
{
	memset(&pace->map, 0, sizeof(pace->map));
	pace->map.path_bound_ns = pace->opened_bound_ns + usb_wave_ns(pace->divisor, AHEAD_SAMPLES);
	clock_map_anchor(&pace->map, pace->origin_ns, pace->opened_ns, pace->opened_bound_ns);
}

/* What the clocks differ by now; it goes on into the next stream. */
static int64_t delay_ns(const struct usb_pace *pace)
{
	return pace->map.last_host_ns - pace->map.last_device_ns;
}

void usb_pace_begin(struct usb_pace *pace, const struct usb_wave *wave, int64_t period_ns,
		    int64_t first_sample, int64_t before_ns, int64_t after_ns)
{
	int64_t sample_ns = usb_wave_ns(wave->divisor, 1);
	int64_t opened_ns = before_ns + (after_ns - before_ns) / 2;

	pace->origin_ns = opened_ns - delay_ns(pace);
	pace->divisor = wave->divisor;
	pace->period = wave->period;
	pace->slack = wave->slack;
	pace->period_ns = period_ns;
	pace->first_sample = first_sample;
	pace->opened_ns = opened_ns;
	pace->opened_bound_ns = (after_ns - before_ns + 1) / 2 + 2 * sample_ns;
	pace->late_count = 0;
	open_map(pace);
}

int64_t usb_pace_device_ns(const struct usb_pace *pace, int64_t sample)
{
	return pace->origin_ns + usb_wave_ns(pace->divisor, sample - pace->first_sample);
}

/* Before the first reading there is nothing but the beginning. */
int64_t usb_pace_host_ns(struct usb_pace *pace, int64_t sample, int64_t *uncertainty_ns)
{
	int64_t device_ns = usb_pace_device_ns(pace, sample);

	return clock_map_host_ns(&pace->map, device_ns, uncertainty_ns);
}

void usb_pace_seek(struct usb_pace *pace, int64_t sample)
{
	int64_t uncertainty_ns, host_ns = usb_pace_host_ns(pace, sample, &uncertainty_ns);

	pace->shot_sample = sample;
	if (!pace->due_ns) {
		pace->due_ns = host_ns;
		return;
	}
	while (pace->due_ns < host_ns) {
		pace->due_ns += pace->period_ns;
		pace->shot++;
	}
	pace->shot_sample += usb_wave_samples(pace->divisor, pace->due_ns - host_ns);
}

static int64_t clamp(int64_t value, int64_t limit)
{
	return value > limit ? limit : value < -limit ? -limit : value;
}

uint32_t usb_pace_advance(struct usb_pace *pace)
{
	int64_t next_sample = pace->shot_sample + pace->period;
	int64_t next_due_ns = pace->due_ns + pace->period_ns, uncertainty_ns;
	int64_t late_ns = usb_pace_host_ns(pace, next_sample, &uncertainty_ns) - next_due_ns;

	next_sample -= clamp(usb_wave_samples(pace->divisor, late_ns), pace->slack);
	uint32_t length = (uint32_t)(next_sample - pace->shot_sample);

	pace->shot++;
	pace->shot_sample = next_sample;
	pace->due_ns = next_due_ns;
	return length;
}

/* By the line through the earliest readings. */
static bool is_late(const struct usb_pace *pace, int64_t device_ns, int64_t host_ns)
{
	const struct clock_map *map = &pace->map;
	int64_t bound_ns = pace->period_ns / LATE_SHARE;
	double line_ns =
		(double)map->base_delay_ns + map->drift * (double)(device_ns - map->base_device_ns);

	if (bound_ns < LATE_MIN_NS)
		bound_ns = LATE_MIN_NS;
	return map->count > 0 && (double)(host_ns - device_ns) > line_ns + (double)bound_ns;
}

bool usb_pace_taken(struct usb_pace *pace, int64_t end_sample, int64_t host_ns)
{
	int64_t device_ns = usb_pace_device_ns(pace, end_sample - AHEAD_SAMPLES);
	uint64_t resets = pace->map.resets;

	if (end_sample - pace->first_sample < AHEAD_SAMPLES)
		return true; /* there was room for more */
	if (!is_late(pace, device_ns, host_ns))
		pace->late_count = 0;
	else if (pace->late_count++ == 0)
		pace->late_from_ns = host_ns;
	clock_map_sample(&pace->map, device_ns, host_ns);
	if (pace->map.resets != resets) { /* far earlier than all before: those were late */
		open_map(pace);
		clock_map_sample(&pace->map, device_ns, host_ns);
	}
	return pace->late_count < LATE_COUNT || host_ns - pace->late_from_ns < LATE_FOR_NS;
}
