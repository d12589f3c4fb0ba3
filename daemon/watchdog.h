/*
 * The real-time threads as one: which of them stand still, and systemd's watchdog, which is kicked
 * only when all of them moved since the last kick. sd_event_set_watchdog() would kick for the event
 * loop alone, while a capture thread hangs. Control thread.
 */
#pragma once

#include <systemd/sd-event.h>

#include "daemon/station.h"
#include "protocol/encode.h"

struct watchdog {
	struct station *station; /* borrowed */
	uint64_t interval_us;
	sd_event_source *timer;
};

/* When systemd asks for it (WATCHDOG_USEC), looks four times per its interval. Returns 0, also when
 * nobody asks, or a negative errno. */
int watchdog_start(struct watchdog *watchdog, sd_event *event, struct station *station);
void watchdog_stop(struct watchdog *watchdog); /* a zeroed one is fine */

/* Once a second: logs which threads stand still and which move again. */
void watch_heartbeats(struct station *station);

/* Looks at all, and tells those that stand still. Returns how many. */
uint32_t find_stalls(struct station *station, int64_t now_ns,
		     struct stream_stall stalls[STREAM_STALL_MAX]);
