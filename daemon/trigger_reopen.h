/*
 * Brings a lost trigger back, on a helper thread: closing and opening a device may block, and the
 * control thread has subscribers to serve.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "base/diag.h"
#include "drivers/trigger.h"

struct trigger_reopener {
	/* control thread */
	bool busy;
	pthread_t thread;

	/* helper thread; the control thread after `done` */
	const struct trigger_driver *driver;
	const char *rest;        /* of its address; borrowed */
	struct trigger *trigger; /* the lost one to close, or NULL; then the one that came back */
	struct diag diag;
	int error;
	_Atomic bool done;
};

/* Closes `lost` (NULL is fine) and tries to open the trigger of `address` again. False when it
 * cannot; then nothing has happened. */
bool trigger_reopen_begin(struct trigger_reopener *reopener, const struct trigger_driver *driver,
			  const char *address, struct trigger *lost);

/* True once when an attempt is over: then `error` and `trigger` hold its result, and `diag` what
 * was wrong, until the next attempt. */
bool trigger_reopen_poll(struct trigger_reopener *reopener);

/* Waits for an attempt under way, at most 0.5 s. False when it goes on: then nothing that it uses
 * may be freed. */
bool trigger_reopen_finish(struct trigger_reopener *reopener);
