/*
 * Brings lost cameras back, one at a time, on a helper thread: opening a device may block for
 * seconds, and the control thread has subscribers to serve.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>

#include "config/stage.h"
#include "drivers/open_cameras.h"

struct reopener {
	/* control thread */
	bool busy;
	uint32_t camera;
	pthread_t thread;

	/* helper thread; the control thread after `done` */
	const struct stage *stage;
	const struct camera_driver *const *drivers;
	uint32_t fires;            /* of the trigger */
	struct open_camera device; /* the lost one to close, then the one that came back */
	struct diag diag;
	int error;
	_Atomic bool done;
};

/* Closes `lost` (which may already be closed) and tries to open camera `index` again. Does nothing,
 * and returns false, while busy with another. */
bool reopen_begin(struct reopener *reopener, const struct stage *stage,
		  const struct camera_driver *const *drivers, uint32_t fires, uint32_t index,
		  const struct open_camera *lost);

/* True once when an attempt is over: then `camera`, `error` and `device` hold its result, and
 * `diag` what was wrong, until the next attempt. */
bool reopen_poll(struct reopener *reopener);

/* Waits for an attempt under way, at most 0.5 s: a camera that does not answer may take a driver
 * seconds. False when it goes on: then nothing that it uses may be freed. */
bool reopen_finish(struct reopener *reopener);
