/*
 * Each line has one pulse at a time. All of a shot's pulses move with its IR pulse when that is
 * late, so that the strobe stays inside the exposure; the next shot does not.
 */
#include "drivers/gpio/pulse_train.h"

#include <string.h>

#include "base/clock.h"
#include "drivers/trigger_plan.h"

#define SHORT_SHARE 10 /* of its width: what a pulse may lack before it is told */
#define PATIENCE_NS                                                                   \
	(2 * NS_PER_MS) /* for the input's edge behind a pulse, within PATIENCE_SHARE \
			 */
#define PATIENCE_SHARE 4

static int64_t least(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static int64_t most(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

static int64_t late_max_ns(const struct pulse_train *train)
{
	return train->plan.period_ns / PULSE_LATE_SHARE;
}

static bool is_lit(const struct pulse_train *train, enum pulse_line line)
{
	return train->lit & PULSE_BIT(line);
}

static bool is_wired(const struct pulse_train *train, enum pulse_line line)
{
	return train->source.wired & PULSE_BIT(line);
}

void pulse_train_note(struct pulse_train *train, enum pulse_event event)
{
	*(train->under_way ? &train->made.events : &train->strange) |= UINT32_C(1) << event;
}

void pulse_train_begin(struct pulse_train *train, const struct trigger_plan *plan,
		       const struct pulse_source *source, int64_t now_ns)
{
	memset(train, 0, sizeof(*train));
	train->plan = *plan;
	train->source = *source;
	if (!(train->plan.strobe_duty_max > 0))
		train->plan.strobe_duty_max = STROBE_DUTY_MAX_DEFAULT;
	train->next_ns = source->paced_by_input ? PULSE_NEVER : now_ns + plan->period_ns;
	train->credit_at_ns = now_ns;
	train->report_ns = PULSE_NEVER;
}

/* The shot before is over, and its lines are dark: the next edge will be one. */
static bool may_begin(const struct pulse_train *train)
{
	return !train->under_way && !is_lit(train, PULSE_IR) && !is_lit(train, PULSE_STROBE);
}

int64_t pulse_train_due_ns(const struct pulse_train *train)
{
	int64_t due_ns = train->under_way ? train->report_ns : PULSE_NEVER;

	if (may_begin(train))
		due_ns = train->next_ns;
	for (int l = 0; l < PULSE_LINE_COUNT; l++) {
		const struct pulse *pulse = &train->pulses[l];

		if (pulse->planned)
			due_ns = least(due_ns, train->lit >> l & 1 ? pulse->off_ns : pulse->on_ns);
	}
	return due_ns;
}

static struct pulse plan_pulse(int64_t edge_ns, int64_t delay_ns, int64_t length_ns)
{
	return (struct pulse){length_ns > 0, edge_ns + delay_ns, edge_ns + delay_ns + length_ns};
}

static void plan_hd(struct pulse_train *train, int64_t edge_ns)
{
	const struct trigger_plan *plan = &train->plan;

	if (train->next_shot % (uint64_t)plan->hd_divider != (uint64_t)plan->hd_phase)
		return;
	if (train->pulses[PULSE_HD].planned)
		pulse_train_note(train, PULSE_HD_SKIPPED); /* the one before is not over */
	else
		train->pulses[PULSE_HD] =
			plan_pulse(edge_ns, plan->hd_delay_ns, plan->hd_exposure_ns);
}

/* The periods that have passed by now are missed. */
static void miss(struct pulse_train *train, int64_t late_ns)
{
	int64_t period_ns = train->plan.period_ns, count = late_ns / period_ns + 1;

	if (train->source.paced_by_input) {
		train->missed++;
		train->next_shot++;
		train->next_ns = PULSE_NEVER;
		return;
	}
	train->missed += (uint32_t)count;
	train->next_shot += (uint64_t)count;
	train->next_ns += count * period_ns;
}

static void begin_shot(struct pulse_train *train, int64_t now_ns)
{
	const struct trigger_plan *plan = &train->plan;
	int64_t edge_ns = train->next_ns;

	if (now_ns - edge_ns > late_max_ns(train)) {
		miss(train, now_ns - edge_ns);
		return;
	}
	train->made = (struct edge){
		.shot = train->next_shot, .missed = train->missed, .events = train->strange};
	train->under_way = true;
	train->fired = train->burnt = train->exposed = false;
	train->report_ns = PULSE_NEVER;
	train->base_ns = edge_ns;
	train->missed = train->strange = 0;
	train->pulses[PULSE_IR] = plan_pulse(edge_ns, plan->ir_delay_ns, plan->ir_exposure_ns);
	if (is_wired(train, PULSE_STROBE))
		train->pulses[PULSE_STROBE] =
			plan_pulse(edge_ns, plan->strobe_delay_ns, plan->strobe_width_ns);
	if (is_wired(train, PULSE_HD))
		plan_hd(train, edge_ns);
	train->next_shot++;
	train->next_ns = train->source.paced_by_input ? PULSE_NEVER : edge_ns + plan->period_ns;
}

/* Too late for its first pulse: nothing of the shot is fired but what already was. */
static void give_up(struct pulse_train *train)
{
	train->pulses[PULSE_IR].planned = train->pulses[PULSE_STROBE].planned = false;
	if (!is_lit(train, PULSE_HD))
		train->pulses[PULSE_HD].planned = false;
	train->missed += train->made.missed + 1;
	train->strange |= train->made.events;
	train->under_way = false;
}

static bool light_ir(struct pulse_train *train, int64_t now_ns)
{
	int64_t late_ns = now_ns - train->pulses[PULSE_IR].on_ns;

	if (late_ns > late_max_ns(train)) {
		give_up(train);
		return false;
	}
	train->made.late_ns = late_ns;
	train->pulses[PULSE_STROBE].on_ns += late_ns;
	train->pulses[PULSE_STROBE].off_ns += late_ns;
	return true;
}

/* What a strobe has not burnt it may burn later, but never more than one pulse. */
static double credit(struct pulse_train *train, int64_t now_ns)
{
	double most_ns = (double)train->plan.strobe_width_ns;

	train->credit_ns += train->plan.strobe_duty_max * (double)(now_ns - train->credit_at_ns);
	train->credit_at_ns = now_ns;
	if (train->credit_ns > most_ns)
		train->credit_ns = most_ns;
	return train->credit_ns;
}

static bool light_strobe(struct pulse_train *train, int64_t now_ns)
{
	struct pulse *pulse = &train->pulses[PULSE_STROBE];
	int64_t width_ns = train->plan.strobe_width_ns;
	int64_t burn_ns = least(pulse->off_ns - now_ns, (int64_t)credit(train, now_ns));

	if (burn_ns < width_ns / 2) {
		pulse->planned = false;
		pulse_train_note(train, PULSE_STROBE_SKIPPED);
		return false;
	}
	if (burn_ns < width_ns - width_ns / SHORT_SHARE)
		pulse_train_note(train, PULSE_STROBE_SHORT);
	pulse->off_ns = now_ns + burn_ns;
	return true;
}

static bool light_hd(struct pulse_train *train, int64_t now_ns)
{
	struct pulse *pulse = &train->pulses[PULSE_HD];

	if (now_ns - pulse->on_ns <= late_max_ns(train))
		return true;
	pulse->planned = false;
	pulse_train_note(train, PULSE_HD_SKIPPED);
	return false;
}

/* The shot is over when its light is out and the input had time to answer. */
static void see_whether_over(struct pulse_train *train, int64_t now_ns)
{
	int64_t patience_ns = train->source.reports_exposure
				      ? least(PATIENCE_NS, train->plan.period_ns / PATIENCE_SHARE)
				      : 0;

	if (train->under_way && train->fired && !train->pulses[PULSE_STROBE].planned &&
	    train->report_ns == PULSE_NEVER)
		train->report_ns = most(now_ns, train->opened_ns + patience_ns);
}

uint32_t pulse_train_step(struct pulse_train *train, int64_t now_ns)
{
	static bool (*const light[PULSE_LINE_COUNT])(struct pulse_train *, int64_t) = {
		[PULSE_IR] = light_ir, [PULSE_STROBE] = light_strobe, [PULSE_HD] = light_hd};
	uint32_t wanted = train->lit;

	if (may_begin(train) && train->next_ns <= now_ns)
		begin_shot(train, now_ns);
	for (int l = 0; l < PULSE_LINE_COUNT; l++) {
		const struct pulse *pulse = &train->pulses[l];

		if (!pulse->planned)
			continue;
		if (train->lit >> l & 1) {
			if (pulse->off_ns <= now_ns)
				wanted &= ~PULSE_BIT(l);
		} else if (pulse->on_ns <= now_ns && light[l](train, now_ns)) {
			wanted |= PULSE_BIT(l);
		}
	}
	see_whether_over(train, now_ns);
	return wanted;
}

static void note_ir(struct pulse_train *train, int64_t middle_ns, int64_t after_ns)
{
	train->fired = true;
	train->opened_ns = middle_ns;
	train->made.late_ns = after_ns - train->pulses[PULSE_IR].on_ns;
	if (!is_wired(train, PULSE_IR) && train->source.paced_by_input) {
		train->opened_ns = train->pulses[PULSE_IR].on_ns;
		train->opened_off_ns = train->source.uncertainty_ns;
	}
}

static void note_dark(struct pulse_train *train, int64_t middle_ns, int64_t half_ns,
		      int64_t after_ns)
{
	train->burnt = true;
	train->dark_ns = middle_ns;
	train->lit_off_ns = most(train->lit_off_ns, half_ns);
	credit(train, after_ns);
	train->credit_ns -= (double)(after_ns - train->lit_from_ns);
}

void pulse_train_done(struct pulse_train *train, uint32_t lit, int64_t before_ns, int64_t after_ns)
{
	uint32_t on = lit & ~train->lit, off = train->lit & ~lit;
	int64_t half_ns = (after_ns - before_ns + 1) / 2, middle_ns = before_ns + half_ns;

	train->lit = lit;
	for (int l = 0; l < PULSE_LINE_COUNT; l++)
		if (off >> l & 1)
			train->pulses[l].planned = false;
	if (on & PULSE_BIT(PULSE_IR)) {
		train->opened_off_ns = half_ns;
		note_ir(train, middle_ns, after_ns);
	}
	if (on & PULSE_BIT(PULSE_STROBE)) {
		train->lit_ns = middle_ns;
		train->lit_from_ns = before_ns;
		train->lit_off_ns = half_ns;
	}
	if (off & PULSE_BIT(PULSE_STROBE))
		note_dark(train, middle_ns, half_ns, after_ns);
	see_whether_over(train, after_ns);
}
