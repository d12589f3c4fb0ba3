/*
 * The solver thread: takes the fronts of all queues, asks sync which of them are a shot, tracks it
 * and queues the marker set for the control thread. A shot is closed at a deadline, so that no
 * camera can stall it.
 */
#pragma once

#include <stdatomic.h>

#include "base/clock.h"
#include "base/handover.h"
#include "base/ring.h"
#include "config/stage.h"
#include "daemon/capture.h"
#include "daemon/pulses.h"
#include "daemon/realtime.h"
#include "daemon/shot_book.h"
#include "daemon/shot_copy.h"
#include "daemon/warm_up.h"
#include "track/sync/sync.h"

/* What differs from run to run. */
struct solver_run {
	const struct trigger_plan *plan; /* borrowed, until the next */
	int64_t period_ns;               /* of a shot; 0 = not known beforehand */
	bool solve;      /* false: shots are put together and counted, no marker set is made */
	uint32_t number; /* into every set */
};

struct solver {
	/* set before the thread starts; all borrowed but the scratch */
	const struct stage *stage;
	struct handover *rigs; /* of const struct live_rig */
	struct capture *captures;
	struct pulses *pulses; /* NULL when no trigger reports edges */
	struct shot_copy *shot_copy;
	int control_wake_fd;
	int64_t deadline_ns; /* after the oldest front was found */
	struct tracker_scratch *scratch;
	struct solver_run run;

	/* control thread */
	struct realtime_thread thread;

	/* solver thread */
	struct warm_up warm_up;
	struct sync sync;
	struct shot_book book; /* its events: any thread reads */
	struct hd_plan hd;
	const struct live_rig *rig; /* taken last */
	struct tracker_state tracker;
	uint32_t missed_in_a_row[CAMERA_MAX];

	struct clock_semaphore wake; /* capture and trigger threads post it */
	struct ring sets;            /* of marker_set, solver to control thread */
	_Atomic bool stopping;
	_Atomic bool all_ended;
	/* any thread reads */
	_Atomic uint64_t shots;      /* marker sets made */
	_Atomic uint64_t incomplete; /* of them, those with a camera missing */
	_Atomic uint64_t lost;       /* shot numbers that no marker set bears */
};

/* Control thread. Returns 0 or -ENOMEM. */
int solver_init(struct solver *solver, const struct stage *stage, struct handover *rigs,
		struct capture *captures, struct pulses *pulses, struct shot_copy *shot_copy,
		int control_wake_fd, uint32_t queue_length);
void solver_finish(struct solver *solver); /* a zeroed solver is fine */

/* Forgets the run before: counters, shot numbers, what was tracked. Marker sets that still wait for
 * the control thread stay. */
void solver_begin_run(struct solver *solver, const struct solver_run *run);

int solver_start(struct solver *solver, struct diag *diag);
bool solver_stop(struct solver *solver); /* false when the thread hangs */
