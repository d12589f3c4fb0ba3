/*
 * Real-time threads where the system allows them, normal ones with a word about it where not.
 */
#pragma once

#include <pthread.h>
#include <stdbool.h>

#include "daemon/heartbeat.h"

/* SCHED_FIFO priorities, the order of docs/architecture.md. */
#define PRIORITY_SOLVER 40
#define PRIORITY_CAPTURE 50
#define PRIORITY_TRIGGER 60

struct realtime_thread {
	/* set before the thread starts */
	const char *name; /* borrowed; at most 15 characters show */
	void (*run)(void *argument);
	void *argument;
	/* control thread */
	pthread_t id;
	bool joinable;
	bool fifo_granted;
	bool stall_told; /* logged once */
	int64_t told_ns; /* CLOCK_MONOTONIC when it was told to end; 0: not yet */
	struct heartbeat heartbeat;
};

/* Brings what is mapped into memory, and keeps it and what will be touched there. False, with a log
 * line, when not allowed. Control thread, as all below. */
bool realtime_lock_memory(void);

/* Starts `run`, all of it one real-time section, with SCHED_FIFO, or with normal scheduling where
 * that is not allowed or time is virtual. name, run and argument must be set. Returns 0 or a
 * negative errno. */
int realtime_thread_start(struct realtime_thread *thread, int priority);

/* Its patience begins: for threads that are told to end together, before the first is joined. */
void realtime_thread_tell(struct realtime_thread *thread);

/* Waits for the end of the thread, and at most 0.5 s (in virtual time 20 s) from when it was told.
 * False when it hangs: then nothing that it uses may be freed. A thread that does not run is fine.
 */
bool realtime_thread_join(struct realtime_thread *thread);
