/*
 * The trigger and its thread: every edge it reports goes to the solver. A trigger that reports none
 * (free running) has no thread.
 */
#pragma once

#include <stdatomic.h>

#include "base/clock.h"
#include "base/ring.h"
#include "daemon/realtime.h"
#include "drivers/trigger.h"
#include "track/sync.h"

struct pulses {
	/* set before the thread starts */
	const struct trigger_driver *driver;
	struct trigger *trigger; /* owned */
	struct trigger_plan plan;
	struct clock_semaphore *solver_wake; /* borrowed */

	/* control thread */
	struct realtime_thread thread;
	bool armed;

	struct ring edges; /* of struct edge, trigger thread to solver */
	_Atomic bool stopping;
	_Atomic bool lost; /* the trigger is gone */
	_Atomic uint64_t edges_count;
	_Atomic uint64_t edges_refused; /* the queue was full */
};

/* Opens the trigger of an address. Returns 0 or a negative errno with a message. Control thread, as
 * all below. */
int pulses_open(struct pulses *pulses, const char *address, const struct trigger_plan *plan,
		const struct trigger_driver *const *drivers, uint32_t queue_length,
		struct diag *diag);
void pulses_close(struct pulses *pulses); /* a zeroed struct is fine */

/* Counts anew and drops what is queued. */
void pulses_begin_run(struct pulses *pulses);

/* Arms the trigger, once the cameras are started. */
int pulses_start(struct pulses *pulses, struct diag *diag);

/* All lines are dark when it returns. False when the thread hangs in its driver: then the trigger
 * may be neither closed nor started. */
bool pulses_stop(struct pulses *pulses);
