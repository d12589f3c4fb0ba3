/*
 * The trigger of stages that have none: it fires nothing and reports nothing.
 */
#include "drivers/trigger_free.h"

#include <errno.h>
#include <stdlib.h>

#include "base/clock.h"
#include "drivers/trigger_plan.h"

static int check_rest(const char *rest, struct diag *diag)
{
	if (!*rest)
		return 0;
	diag_add(diag, "trigger free:%s: the free trigger takes no device; write free", rest);
	return -EINVAL;
}

static int free_check(const char *rest, const struct trigger_plan *plan, struct diag *diag)
{
	(void)plan;
	return check_rest(rest, diag);
}

static int free_open(struct trigger **out, const char *rest, struct diag *diag)
{
	struct trigger *trigger;

	int err = check_rest(rest, diag);

	if (err)
		return err;
	trigger = malloc(sizeof(*trigger));
	if (!trigger) {
		diag_add(diag, "trigger free: out of memory");
		return -ENOMEM;
	}
	trigger->driver = &free_trigger_driver;
	*out = trigger;
	return 0;
}

static void free_close(struct trigger *trigger)
{
	free(trigger);
}

static int free_arm(struct trigger *trigger, const struct trigger_plan *plan, struct diag *diag)
{
	(void)trigger;
	return trigger_plan_check(plan, "free", diag);
}

static void free_disarm(struct trigger *trigger)
{
	(void)trigger;
}

static int free_next(struct trigger *trigger, int64_t timeout_ns, struct edge *out)
{
	(void)trigger;
	(void)out;
	clock_sleep_until(clock_now_ns() + timeout_ns);
	return -ETIMEDOUT;
}

const struct trigger_driver free_trigger_driver = {
	.name = "free",
	.reports_edges = false,
	.check = free_check,
	.open = free_open,
	.close = free_close,
	.arm = free_arm,
	.disarm = free_disarm,
	.next = free_next,
};
