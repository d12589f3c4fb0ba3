/*
 * One attempt per errand.
 */
#include "daemon/trigger_reopen.h"

#include <string.h>

static void try_again(void *user)
{
	struct trigger_reopener *reopener = user;

	reopener->driver->close(reopener->trigger);
	reopener->trigger = NULL;
	reopener->error =
		reopener->driver->open(&reopener->trigger, reopener->rest, &reopener->diag);
}

bool trigger_reopen_begin(struct trigger_reopener *reopener, const struct trigger_driver *driver,
			  const char *address, struct trigger *lost)
{
	const char *colon = strchr(address, ':');

	if (reopener->errand.busy)
		return false;
	diag_finish(&reopener->diag);
	reopener->driver = driver;
	reopener->rest = colon ? colon + 1 : "";
	reopener->trigger = lost;
	return errand_begin(&reopener->errand, try_again, reopener);
}

bool trigger_reopen_poll(struct trigger_reopener *reopener)
{
	return errand_poll(&reopener->errand);
}

bool trigger_reopen_finish(struct trigger_reopener *reopener)
{
	bool busy = reopener->errand.busy;

	if (!errand_finish(&reopener->errand))
		return false;
	if (busy)
		reopener->driver->close(reopener->trigger);
	diag_finish(&reopener->diag);
	return true;
}
