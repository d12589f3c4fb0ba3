/*
 * Real-time threads where the system allows them, normal ones with a word about it where not.
 */
#pragma once

#include <pthread.h>
#include <stdbool.h>

/* SCHED_FIFO priorities, the order of docs/architecture.md. */
#define PRIORITY_SOLVER 40
#define PRIORITY_CAPTURE 50
#define PRIORITY_TRIGGER 60

/* Keeps what is touched in memory. False, with a log line, when not allowed. Control thread. */
bool realtime_lock_memory(void);

/* Starts a thread with SCHED_FIFO, or with normal scheduling where that is not allowed or time is
 * virtual, and names it (at most 15 characters). It must call clock_thread_begin() first and
 * clock_thread_end() last. `*granted` says which. Returns 0 or a negative errno. */
int realtime_thread_start(pthread_t *out, const char *name, int priority, void *(*run)(void *),
			  void *argument, bool *granted);
