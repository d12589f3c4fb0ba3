/*
 * The trigger and its thread: every edge it reports goes to the solver. A trigger that reports none
 * (free running) has no thread.
 */
#pragma once

#include <stdatomic.h>

#include "base/clock.h"
#include "base/histogram.h"
#include "base/ring.h"
#include "daemon/realtime.h"
#include "drivers/trigger.h"
#include "track/sync/sync.h"

#define PULSES_WHY_BYTES 200

/* What became of the pulses of a run. Control thread. */
struct pulse_accounts {
	struct histogram late; /* how long after its time each was fired */
	uint64_t missed;       /* periods in which nothing was fired */
	uint64_t missed_shot;  /* the last of them, once there was any */
	uint64_t events[PULSE_EVENT_COUNT];
	uint64_t event_shot; /* of the last event, once there was any */
	uint32_t event;      /* enum pulse_event */
	uint32_t told;       /* events that were logged */
	uint64_t reopened;
	uint32_t quiet_s; /* since the last one, while there should be some */
};

#define PULSES_QUIET_S 3 /* from then on it is told */

struct pulses {
	/* set before the thread starts */
	const struct trigger_driver *driver;
	struct trigger *trigger; /* owned; NULL while a lost one is looked for */
	struct trigger_plan plan;
	struct clock_semaphore *solver_wake; /* borrowed */

	/* control thread */
	struct realtime_thread thread;
	bool armed;
	struct pulse_accounts accounts;
	int64_t lost_since_ns; /* 0: it is there */
	char lost_why[PULSES_WHY_BYTES];

	/* trigger thread */
	struct edge last; /* as it went to the solver; so far, when any_edge */
	bool any_edge;
	bool renumber;       /* the next edge is the first since it came back */
	uint64_t first_shot; /* that the driver's shot 0 is */

	struct ring edges;   /* of struct edge, trigger thread to solver */
	struct ring reports; /* the same, to the control thread */
	_Atomic bool stopping;
	_Atomic bool lost; /* the trigger is gone */
	_Atomic int lost_error;
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

/* Once a second: what the trigger thread reported goes into the accounts; what is new of it is
 * logged, with the shots' numbers. */
void pulses_account(struct pulses *pulses, const char *address);

/* The lost trigger, whose thread has ended, is handed out to be closed. */
struct trigger *pulses_give_up(struct pulses *pulses);

/* It came back: its pulses are numbered on, by the time that has passed. When `run`, they begin.
 * Returns 0 or a negative errno with a message. */
int pulses_take_back(struct pulses *pulses, struct trigger *trigger, bool run, struct diag *diag);
