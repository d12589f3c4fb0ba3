/*
 * One attempt per helper thread.
 */
#include "daemon/trigger_reopen.h"

#include <string.h>

#include "base/clock.h"

#define PATIENCE_NS (500 * NS_PER_MS)

static void *run_attempt(void *argument)
{
	struct trigger_reopener *reopener = argument;

	reopener->driver->close(reopener->trigger);
	reopener->trigger = NULL;
	reopener->error =
		reopener->driver->open(&reopener->trigger, reopener->rest, &reopener->diag);
	atomic_store(&reopener->done, true);
	return NULL;
}

bool trigger_reopen_begin(struct trigger_reopener *reopener, const struct trigger_driver *driver,
			  const char *address, struct trigger *lost)
{
	const char *colon = strchr(address, ':');

	if (reopener->busy)
		return false;
	diag_finish(&reopener->diag);
	reopener->driver = driver;
	reopener->rest = colon ? colon + 1 : "";
	reopener->trigger = lost;
	atomic_store(&reopener->done, false);
	reopener->busy = pthread_create(&reopener->thread, NULL, run_attempt, reopener) == 0;
	return reopener->busy;
}

bool trigger_reopen_poll(struct trigger_reopener *reopener)
{
	if (!reopener->busy || !atomic_load(&reopener->done))
		return false;
	pthread_join(reopener->thread, NULL);
	reopener->busy = false;
	return true;
}

bool trigger_reopen_finish(struct trigger_reopener *reopener)
{
	int64_t until_ns = clock_real_now_ns() + PATIENCE_NS;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	if (reopener->busy) {
		if (pthread_clockjoin_np(reopener->thread, NULL, CLOCK_MONOTONIC, &until) != 0)
			return false;
		reopener->driver->close(reopener->trigger);
		reopener->busy = false;
	}
	diag_finish(&reopener->diag);
	return true;
}
