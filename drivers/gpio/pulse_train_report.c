/*
 * What a shot became: its time, from what was lit and what the input told, and what was strange
 * about it.
 */
#include "base/clock.h"
#include "drivers/gpio/pulse_train.h"
#include "drivers/trigger_plan.h"

#define EARLY_NS (5 * NS_PER_US) /* clocks of one machine may disagree by as much */
#define JITTER_SHARE 64          /* of a period */
#define PACE_JITTER_SHARE 16
#define INPUT_KNOWN 8 /* edges until the usual time is known */
#define RESOLUTION_NS (1 * NS_PER_US)

static const char *const names[PULSE_EVENT_COUNT] = {
	[PULSE_STROBE_SHORT] = "strobe_short",   [PULSE_STROBE_SKIPPED] = "strobe_skipped",
	[PULSE_GUARD_CUT] = "guard_cut",         [PULSE_HD_SKIPPED] = "hd_skipped",
	[PULSE_INPUT_MISSING] = "input_missing", [PULSE_INPUT_DOUBLED] = "input_doubled",
	[PULSE_INPUT_JITTER] = "input_jitter",   [PULSE_UNDERRUN] = "underrun",
};

const char *pulse_event_name(enum pulse_event event)
{
	return event < PULSE_EVENT_COUNT ? names[event] : NULL;
}

static int64_t later(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

static int64_t earlier(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static void learn_input(struct pulse_train *train)
{
	int64_t delay_ns = train->exposed_ns - train->opened_ns;
	int64_t off_ns = delay_ns - train->input_mean_ns;

	if (train->input_count >= INPUT_KNOWN && (off_ns > train->plan.period_ns / JITTER_SHARE ||
						  off_ns < -train->plan.period_ns / JITTER_SHARE))
		pulse_train_note(train, PULSE_INPUT_JITTER);
	train->input_count++;
	train->input_mean_ns +=
		off_ns / (train->input_count < INPUT_KNOWN ? train->input_count : INPUT_KNOWN);
}

/* The edge that the plan's middle of the light counts from, so that it is where the light was. */
static void time_shot(struct pulse_train *train)
{
	int64_t open_ns = train->exposed ? train->exposed_ns : train->opened_ns;
	int64_t off_ns = train->exposed ? train->source.uncertainty_ns : train->opened_off_ns;
	int64_t shut_ns = open_ns + train->plan.ir_exposure_ns;

	train->made.edge_ns = open_ns - train->plan.ir_delay_ns;
	if (train->burnt && train->lit_ns < shut_ns && train->dark_ns > open_ns) {
		int64_t begin_ns = later(open_ns, train->lit_ns);
		int64_t end_ns = earlier(shut_ns, train->dark_ns);

		train->made.edge_ns = begin_ns + (end_ns - begin_ns) / 2 -
				      trigger_plan_ir_middle_ns(&train->plan);
		off_ns = later(off_ns, train->lit_off_ns);
	}
	train->made.uncertainty_ns = off_ns + RESOLUTION_NS;
}

bool pulse_train_report(struct pulse_train *train, int64_t now_ns, struct edge *out)
{
	if (!train->under_way || now_ns < train->report_ns)
		return false;
	if (train->exposed)
		learn_input(train);
	else if (train->source.reports_exposure)
		pulse_train_note(train, PULSE_INPUT_MISSING);
	time_shot(train);
	train->under_way = false;
	train->report_ns = PULSE_NEVER;
	*out = train->made;
	return true;
}

void pulse_train_pace(struct pulse_train *train, int64_t edge_ns)
{
	int64_t period_ns = train->plan.period_ns, passed_ns = edge_ns - train->paced_ns;
	int64_t count = (passed_ns + period_ns / 2) / period_ns;

	if (train->paced_any && (passed_ns < period_ns / 2 || train->next_ns != PULSE_NEVER)) {
		pulse_train_note(train, PULSE_INPUT_DOUBLED);
		return;
	}
	if (train->paced_any) {
		int64_t off_ns = passed_ns - count * period_ns;

		if (off_ns > period_ns / PACE_JITTER_SHARE ||
		    off_ns < -period_ns / PACE_JITTER_SHARE)
			train->strange |= UINT32_C(1) << PULSE_INPUT_JITTER;
		train->missed += (uint32_t)(count - 1);
		train->next_shot += (uint64_t)(count - 1);
	}
	train->paced_any = true;
	train->paced_ns = train->next_ns = edge_ns;
}

void pulse_train_exposed(struct pulse_train *train, int64_t edge_ns)
{
	bool behind = train->under_way && train->fired && edge_ns >= train->opened_ns - EARLY_NS;

	if (!behind || train->exposed) {
		pulse_train_note(train, PULSE_INPUT_DOUBLED);
		return;
	}
	train->exposed = true;
	train->exposed_ns = edge_ns;
}
