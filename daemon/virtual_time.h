/*
 * The station in virtual time (base/clock_virtual.h): when time begins, how tests drive it, and
 * that it waits for subscribers. Control thread only. In real time nothing here does anything.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

#include "config/config.h"

struct virtual_time {
	bool stepped;            /* goes on only when asked to */
	bool outrun_subscribers; /* those who read too slowly lose sets, as in real time */
	bool holding;            /* for a subscriber */
};

/* Before any thread is started and any device opened. */
void virtual_time_begin(struct virtual_time *virtual_time, const struct config *config);

/* `backlog`: sets are queued that a subscriber has not taken yet. Call it whenever that may have
 * changed. */
void virtual_time_mind_subscribers(struct virtual_time *virtual_time, bool backlog);

/* The control method Advance: allows time to go on. Returns the reply. */
json_t *virtual_time_advance(struct virtual_time *virtual_time, const json_t *parameters);
