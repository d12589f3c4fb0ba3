/*
 * Runs in a process of its own, when the station is gone.
 */
#include "daemon/darken.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "config/config.h"
#include "daemon/program_drivers.h"
#include "sim/world/world.h"

#define BUSY_PATIENCE_NS (500 * NS_PER_MS)

/* What the station had may be held for a moment by its guard, which darkens it too. */
static int open_trigger(struct trigger **out, const struct trigger_driver *driver, const char *rest,
			struct diag *diag)
{
	int64_t until_ns = clock_now_ns() + BUSY_PATIENCE_NS;
	struct diag busy = {0};
	int err;

	while ((err = driver->open(out, rest, &busy)) == -EBUSY && clock_now_ns() < until_ns) {
		diag_finish(&busy);
		clock_sleep_until(clock_now_ns() + 5 * NS_PER_MS);
	}
	if (busy.text)
		diag_add(diag, "%.*s", (int)strcspn(busy.text, "\n"), busy.text);
	diag_finish(&busy);
	return err;
}

static int darken_trigger(const char *address, struct diag *diag)
{
	struct sim_options any = {0};
	struct trigger *trigger;
	const char *rest;
	const struct trigger_driver *driver =
		trigger_driver_find(trigger_drivers, address, &rest, diag);
	int err = driver ? 0 : -EINVAL;

	if (driver == &sim_trigger_driver)
		err = sim_world_open(&any, 0, diag); /* it wants a world */
	if (!err)
		err = open_trigger(&trigger, driver, rest, diag);
	if (!err) {
		driver->disarm(trigger);
		driver->close(trigger);
	}
	sim_world_close();
	return err;
}

/* systemd tells ExecStopPost how the station ended. One that was refused because another runs has
 * lit nothing: what burns is the other's. */
static bool was_refused(void)
{
	const char *status = getenv("EXIT_STATUS");

	return status && atoi(status) == EXIT_CODE_RUNNING;
}

enum exit_code darken(const char *config_path, struct diag *diag)
{
	static struct config config; /* large */

	if (was_refused())
		return EXIT_CODE_OK;
	int err = config_load(&config, config_path, diag);
	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	return exit_code_of(darken_trigger(config.trigger, diag), EXIT_CODE_DEVICE);
}
