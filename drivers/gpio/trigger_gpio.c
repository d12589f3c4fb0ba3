/*
 * Trigger on GPIO lines: lets a pulse train (pulse_train.h) say when which of them is lit. Every
 * change is one system call between two readings of the clock. Lines are lit only while the guard
 * watches.
 */
#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "base/clock_virtual.h"
#include "drivers/gpio/gpio_find.h"
#include "drivers/gpio/trigger_gpio_device.h"
#include "drivers/trigger_plan.h"

#define SPIN_NS (40 * NS_PER_US)       /* before an edge: about what a wake-up takes */
#define GRACE_MIN_NS (100 * NS_PER_US) /* that a burn may last beyond its time */
#define EDGES_PER_READ 16

/* What a single burn may last beyond its time: up to the strobe's share of a period. */
static int64_t grace_ns_of(const struct trigger_plan *plan)
{
	double duty = plan->strobe_duty_max > 0 ? plan->strobe_duty_max : STROBE_DUTY_MAX_DEFAULT;
	int64_t spare_ns = (int64_t)(duty * (double)plan->period_ns) - plan->strobe_width_ns;

	return spare_ns > GRACE_MIN_NS ? spare_ns : GRACE_MIN_NS;
}

/* Edges from before are nobody's. */
static int forget_edges(struct gpio_trigger *trigger)
{
	int64_t edges_ns[EDGES_PER_READ];
	int count = 0;

	do
		count = trigger->input ? gpio_input_read(trigger->input, edges_ns, EDGES_PER_READ)
				       : 0;
	while (count == EDGES_PER_READ);
	return count < 0 ? count : 0;
}

static int gpio_arm(struct trigger *base, const struct trigger_plan *plan, struct diag *diag)
{
	struct gpio_trigger *trigger = (struct gpio_trigger *)base;
	int err = trigger_plan_check(plan, trigger->who + strlen("trigger "), diag);

	if (err)
		return err;
	err = forget_edges(trigger);
	if (!err && trigger->outputs)
		err = gpio_outputs_set(trigger->outputs, trigger->dark_levels);
	if (err) {
		diag_add(diag, "%s: the chip does not answer: %s; plug it in", trigger->who,
			 strerror(-err));
		return err;
	}
	if (trigger->outputs && !trigger_guard_lives(&trigger->guard)) {
		trigger_guard_stop(&trigger->guard);
		err = trigger_guard_start(&trigger->guard, gpio_outputs_fd(trigger->outputs),
					  trigger->output_count, trigger->dark_levels, trigger->who,
					  diag);
		if (err)
			return err;
	}
	trigger->levels = trigger->dark_levels;
	trigger->grace_ns = grace_ns_of(plan);
	pulse_train_begin(&trigger->train, plan, &trigger->source, clock_now_ns());
	atomic_store(&trigger->armed, true);
	return 0;
}

/* Control thread; the trigger thread may hang or be about to wake up. */
static void gpio_disarm(struct trigger *base)
{
	struct gpio_trigger *trigger = (struct gpio_trigger *)base;

	atomic_store(&trigger->armed, false);
	if (trigger->outputs)
		gpio_outputs_set(trigger->outputs, trigger->dark_levels);
	if (trigger->guard.pid)
		trigger_guard_rest(&trigger->guard);
}

static uint32_t levels_of(const struct gpio_trigger *trigger, uint32_t lit)
{
	uint32_t levels = trigger->dark_levels;

	for (int l = 0; l < PULSE_LINE_COUNT; l++)
		if (lit >> l & 1)
			levels ^= trigger->level_bits[l];
	return levels;
}

static int set_lines(struct gpio_trigger *trigger, uint32_t lit)
{
	uint32_t levels = levels_of(trigger, lit);

	if (levels == trigger->levels)
		return 0;
	if (!atomic_load(&trigger->armed))
		return -ENODEV;
	int err = gpio_outputs_set(trigger->outputs, levels);
	if (err)
		return err;
	trigger->levels = levels;
	if (!atomic_load(&trigger->armed)) /* while it was set */
		gpio_outputs_set(trigger->outputs, trigger->dark_levels);
	return 0;
}

static void watch(struct gpio_trigger *trigger, int64_t until_ns)
{
	trigger->watched_ns = until_ns;
	trigger_guard_watch(&trigger->guard, until_ns);
}

/* What is lit must not stay so if this thread does not come back within a period, or as late as a
 * pulse may be. */
static void tell_guard(struct gpio_trigger *trigger)
{
	const struct pulse_train *train = &trigger->train;
	int64_t period_ns = train->plan.period_ns, late_ns = period_ns / PULSE_LATE_SHARE;

	if (!trigger->outputs || train->lit & PULSE_BIT(PULSE_STROBE))
		return;
	if (!train->lit) {
		trigger_guard_rest(&trigger->guard);
		return;
	}
	int64_t back_ns = pulse_train_due_ns(train) + late_ns;
	int64_t period_end_ns = clock_now_ns() + period_ns - late_ns;
	watch(trigger, back_ns > period_end_ns ? back_ns : period_end_ns);
}

/* What the guard set dark stays so: to light it again would be a second edge in its period. */
static void obey_guard(struct gpio_trigger *trigger)
{
	int64_t now_ns = clock_now_ns();
	int64_t cut_ns = trigger->watched_ns < now_ns ? trigger->watched_ns : now_ns;

	trigger->levels = trigger->dark_levels;
	pulse_train_note(&trigger->train, PULSE_GUARD_CUT);
	pulse_train_done(&trigger->train, 0, cut_ns, cut_ns);
}

/* Whatever is to be done now. */
static int step(struct gpio_trigger *trigger)
{
	struct pulse_train *train = &trigger->train;

	if (trigger->outputs && trigger_guard_has_cut(&trigger->guard))
		obey_guard(trigger);
	uint32_t was = train->lit, lit = pulse_train_step(train, clock_now_ns());

	if (lit == was)
		return 0;
	if (lit & ~was && trigger->outputs && !trigger_guard_lives(&trigger->guard))
		return -EOWNERDEAD;
	if (lit & ~was & PULSE_BIT(PULSE_STROBE))
		watch(trigger, train->pulses[PULSE_STROBE].off_ns + trigger->grace_ns);
	int64_t before_ns = clock_now_ns();
	int err = set_lines(trigger, lit);
	int64_t after_ns = clock_now_ns();

	if (err)
		return err;
	pulse_train_done(train, lit, before_ns, after_ns);
	tell_guard(trigger);
	return 0;
}

static int read_input(struct gpio_trigger *trigger)
{
	int64_t edges_ns[EDGES_PER_READ];
	int count = gpio_input_read(trigger->input, edges_ns, EDGES_PER_READ);

	for (int i = 0; i < count; i++)
		if (trigger->source.paced_by_input)
			pulse_train_pace(&trigger->train, edges_ns[i]);
		else
			pulse_train_exposed(&trigger->train, edges_ns[i]);
	return count < 0 ? count : 0;
}

/* Sleeps, then reads the clock until it is time, for SPIN_NS at most. */
static void sleep_exactly_until(int64_t wake_ns)
{
	clock_sleep_until(clock_is_virtual() ? wake_ns : wake_ns - SPIN_NS);
	while (clock_now_ns() < wake_ns)
		;
}

/* Until there is something to do: 0, -ETIMEDOUT, or what is wrong with the input. */
static int wait_for_work(struct gpio_trigger *trigger, int64_t give_up_ns)
{
	int64_t due_ns = pulse_train_due_ns(&trigger->train);
	bool by_input = trigger->source.paced_by_input && !trigger->train.under_way &&
			trigger->train.next_ns == PULSE_NEVER;

	if (by_input && due_ns > clock_now_ns()) {
		int err =
			gpio_input_wait(trigger->input, due_ns < give_up_ns ? due_ns : give_up_ns);

		if (err == -ETIMEDOUT)
			return due_ns <= give_up_ns ? 0 : err;
		return err ? err : read_input(trigger);
	}
	if (due_ns > give_up_ns) {
		clock_sleep_until(give_up_ns);
		return -ETIMEDOUT;
	}
	sleep_exactly_until(due_ns);
	return 0;
}

static int gpio_next(struct trigger *base, int64_t timeout_ns, struct edge *out)
{
	struct gpio_trigger *trigger = (struct gpio_trigger *)base;
	struct pulse_train *train = &trigger->train;
	int64_t give_up_ns = clock_now_ns() + timeout_ns;

	if (!atomic_load(&trigger->armed))
		return -ENODEV;
	for (;;) {
		int err = wait_for_work(trigger, give_up_ns);

		if (!err)
			err = step(trigger);
		if (!err && trigger->source.reports_exposure && train->under_way &&
		    train->report_ns <= clock_now_ns())
			err = read_input(trigger);
		if (err)
			return err;
		if (pulse_train_report(train, clock_now_ns(), out))
			break;
	}
	if (train->lit)
		tell_guard(trigger); /* the next thing to do is the next shot */
	return 0;
}

const struct trigger_driver gpio_trigger_driver = {
	.name = "gpio",
	.reports_edges = true,
	.list = gpio_list,
	.check = gpio_trigger_check,
	.fires = gpio_address_fires,
	.open = gpio_trigger_open,
	.close = gpio_trigger_close,
	.arm = gpio_arm,
	.disarm = gpio_disarm,
	.next = gpio_next,
};
