/*
 * One attempt per helper thread.
 */
#include "daemon/reopen.h"

#include "base/clock_virtual.h"

#define PATIENCE_NS (500 * NS_PER_MS)

static void *run_attempt(void *argument)
{
	struct reopener *reopener = argument;
	struct open_camera *device = &reopener->device;

	if (device->camera)
		device->driver->close(device->camera);
	device->camera = NULL;
	reopener->error =
		open_camera_by_config(device, reopener->stage, reopener->camera, reopener->drivers,
				      reopener->fires, &reopener->diag);
	atomic_store(&reopener->done, true);
	clock_release();
	return NULL;
}

bool reopen_begin(struct reopener *reopener, const struct stage *stage,
		  const struct camera_driver *const *drivers, uint32_t fires, uint32_t index,
		  const struct open_camera *lost)
{
	if (reopener->busy)
		return false;
	diag_finish(&reopener->diag);
	reopener->stage = stage;
	reopener->drivers = drivers;
	reopener->fires = fires;
	reopener->camera = index;
	reopener->device = *lost;
	atomic_store(&reopener->done, false);
	clock_hold(); /* an attempt takes no virtual time */
	reopener->busy = pthread_create(&reopener->thread, NULL, run_attempt, reopener) == 0;
	if (!reopener->busy)
		clock_release();
	return reopener->busy;
}

bool reopen_poll(struct reopener *reopener)
{
	if (!reopener->busy || !atomic_load(&reopener->done))
		return false;
	pthread_join(reopener->thread, NULL);
	reopener->busy = false;
	return true;
}

bool reopen_finish(struct reopener *reopener)
{
	int64_t until_ns = clock_real_now_ns() + PATIENCE_NS;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	if (reopener->busy) {
		if (pthread_clockjoin_np(reopener->thread, NULL, CLOCK_MONOTONIC, &until) != 0)
			return false;
		if (reopener->error == 0)
			reopener->device.driver->close(reopener->device.camera);
		reopener->busy = false;
	}
	diag_finish(&reopener->diag);
	return true;
}
