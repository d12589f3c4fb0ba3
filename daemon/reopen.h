/*
 * Brings lost cameras back, one at a time: opening a device is an errand.
 */
#pragma once

#include "config/stage.h"
#include "daemon/errand.h"
#include "drivers/open_cameras.h"

struct reopener {
	/* control thread */
	struct errand errand;
	uint32_t camera;

	/* the errand's; the control thread's when it is over */
	const struct stage *stage;
	const struct camera_driver *const *drivers;
	uint32_t fires;            /* of the trigger */
	struct open_camera device; /* the lost one to close, then the one that came back */
	struct diag diag;
	int error;
};

/* Closes `lost` (which may already be closed) and tries to open camera `index` again. Does nothing,
 * and returns false, while busy with another. */
bool reopen_begin(struct reopener *reopener, const struct stage *stage,
		  const struct camera_driver *const *drivers, uint32_t fires, uint32_t index,
		  const struct open_camera *lost);

/* True once when an attempt is over: then `camera`, `error` and `device` hold its result, and
 * `diag` what was wrong, until the next attempt. */
bool reopen_poll(struct reopener *reopener);

/* As errand_finish(). */
bool reopen_finish(struct reopener *reopener);
