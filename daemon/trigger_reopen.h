/*
 * Brings a lost trigger back: closing and opening a device is an errand.
 */
#pragma once

#include "base/diag.h"
#include "daemon/errand.h"
#include "drivers/trigger.h"

struct trigger_reopener {
	struct errand errand; /* control thread */

	/* the errand's; the control thread's when it is over */
	const struct trigger_driver *driver;
	const char *rest;        /* of its address; borrowed */
	struct trigger *trigger; /* the lost one to close, or NULL; then the one that came back */
	struct diag diag;
	int error;
};

/* Closes `lost` (NULL is fine) and tries to open the trigger of `address` again. False when it
 * cannot; then nothing has happened. */
bool trigger_reopen_begin(struct trigger_reopener *reopener, const struct trigger_driver *driver,
			  const char *address, struct trigger *lost);

/* True once when an attempt is over: then `error` and `trigger` hold its result, and `diag` what
 * was wrong, until the next attempt. */
bool trigger_reopen_poll(struct trigger_reopener *reopener);

/* As errand_finish(). */
bool trigger_reopen_finish(struct trigger_reopener *reopener);
