/*
 * Trigger `sim`: the pulses that the simulated stage is exposed by. Of `sim:FILE` the file is the
 * strobes' line: it reads 1 while they may burn, also when the station was killed, and 0 when dark.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/trigger_plan.h"
#include "sim/world/world.h"
#include "sim/world/world_parts.h"

#define UNCERTAINTY_NS (1 * NS_PER_US)

struct sim_trigger {
	struct trigger base;
	int line_fd; /* -1 without a line */
	/* set when armed */
	bool armed;
	int64_t middle_ns; /* from a shot's edge to its mid-exposure */
	/* owned by the trigger thread */
	uint64_t next_shot;
};

/* Simulated cameras wait for no line. */
static uint32_t sim_fires(const char *rest)
{
	(void)rest;
	return TRIGGER_FIRES_STROBE;
}

static int sim_open(struct trigger **out, const char *rest, struct diag *diag)
{
	struct sim_trigger *trigger;
	int line_fd = -1;

	if (!sim_world_scene()) {
		diag_add(diag, "trigger sim: no simulated stage is open in this program");
		return -ENODEV;
	}
	if (*rest)
		line_fd = open(rest, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
	if (*rest && line_fd < 0) {
		int r = -errno;

		diag_add(diag, "trigger sim: cannot open the strobes' line %s: %s", rest,
			 strerror(-r));
		return r;
	}
	trigger = calloc(1, sizeof(*trigger));
	if (!trigger) {
		diag_add(diag, "trigger sim: out of memory");
		close(line_fd);
		return -ENOMEM;
	}
	trigger->line_fd = line_fd;
	trigger->base.driver = &sim_trigger_driver;
	*out = &trigger->base;
	return 0;
}

static void sim_close(struct trigger *base)
{
	struct sim_trigger *trigger = (struct sim_trigger *)base;

	if (trigger && trigger->line_fd >= 0)
		close(trigger->line_fd);
	free(trigger);
}

/* Control thread. Returns 0 or a negative errno. */
static int set_line(const struct sim_trigger *trigger, bool lit)
{
	if (trigger->line_fd >= 0 && pwrite(trigger->line_fd, lit ? "1\n" : "0\n", 2, 0) < 0)
		return -errno;
	return 0;
}

static int sim_arm(struct trigger *base, const struct trigger_plan *plan, struct diag *diag)
{
	struct sim_trigger *trigger = (struct sim_trigger *)base;
	int64_t period_ns = sim_scene_period_ns(sim_world_scene());
	int64_t middle_ns;
	int err = trigger_plan_check(plan, "sim", diag);

	if (err)
		return err;
	if (llabs(plan->period_ns - period_ns) > NS_PER_US) { /* rounding aside */
		diag_add(diag,
			 "trigger sim: the plan has %.6g Hz, the simulated stage runs at %.6g Hz: "
			 "give both the same rate",
			 plan->period_ns > 0 ? (double)NS_PER_S / (double)plan->period_ns : 0.0,
			 (double)NS_PER_S / (double)period_ns);
		return -EINVAL;
	}
	middle_ns = trigger_plan_ir_middle_ns(plan);
	trigger->middle_ns = middle_ns;
	trigger->next_shot = sim_world_shot_after(clock_now_ns() + middle_ns);
	err = set_line(trigger, true);
	if (err) {
		diag_add(diag, "trigger sim: cannot set the strobes' line: %s", strerror(-err));
		return err;
	}
	sim_world_light_strobes(plan->strobe_width_ns > 0);
	trigger->armed = true;
	return 0;
}

static void sim_disarm(struct trigger *base)
{
	struct sim_trigger *trigger = (struct sim_trigger *)base;

	trigger->armed = false;
	set_line(trigger, false);
}

static int sim_next(struct trigger *base, int64_t timeout_ns, struct edge *out)
{
	struct sim_trigger *trigger = (struct sim_trigger *)base;
	int64_t asked_ns = clock_now_ns();

	if (!trigger->armed)
		return -ENODEV;
	int64_t edge_ns = sim_world_mid_exposure_ns(trigger->next_shot) - trigger->middle_ns;

	if (edge_ns - asked_ns > timeout_ns) {
		clock_sleep_until(asked_ns + timeout_ns);
		return -ETIMEDOUT;
	}
	clock_sleep_until(edge_ns);
	*out = (struct edge){
		.shot = trigger->next_shot++, .edge_ns = edge_ns, .uncertainty_ns = UNCERTAINTY_NS};
	return 0;
}

const struct trigger_driver sim_trigger_driver = {
	.name = "sim",
	.reports_edges = true,
	.fires = sim_fires,
	.open = sim_open,
	.close = sim_close,
	.arm = sim_arm,
	.disarm = sim_disarm,
	.next = sim_next,
};
