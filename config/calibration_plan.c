/*
 * The station's own plan, slower and longer.
 */
#include "config/calibration_plan.h"

#include "base/clock.h"
#include "drivers/trigger_plan.h"

/* A whole number of the station's own periods, so that whatever keeps one keeps the other. */
static int64_t slower(int64_t period_ns, double rate_hz)
{
	int64_t wanted_ns = (int64_t)((double)NS_PER_S / rate_hz);
	int64_t periods = (wanted_ns + period_ns / 2) / period_ns;

	return period_ns * (periods > 0 ? periods : 1);
}

/* In the middle of the exposure, as long as the strobe may burn. */
static void light(struct trigger_plan *plan)
{
	int64_t safe_ns = (int64_t)(plan->strobe_duty_max * (double)plan->period_ns);

	plan->strobe_width_ns = plan->ir_exposure_ns < safe_ns ? plan->ir_exposure_ns : safe_ns;
	plan->strobe_delay_ns =
		plan->ir_delay_ns + (plan->ir_exposure_ns - plan->strobe_width_ns) / 2;
}

struct trigger_plan calibration_plan(const struct calibration *calibration,
				     const struct trigger_plan *own)
{
	struct trigger_plan plan = *own;

	plan.period_ns = slower(own->period_ns, calibration->rate_hz);
	plan.ir_exposure_ns = calibration->exposure_ns;
	if (calibration->hd_exposure_ns)
		plan.hd_exposure_ns = calibration->hd_exposure_ns;
	plan.hd_divider = 1;
	plan.hd_phase = 0;
	if (own->strobe_width_ns)
		light(&plan);
	int64_t hd_later_ns = trigger_plan_ir_middle_ns(&plan) - trigger_plan_hd_middle_ns(&plan);

	if (hd_later_ns > 0) {
		plan.hd_delay_ns += hd_later_ns;
	} else {
		plan.ir_delay_ns -= hd_later_ns;
		plan.strobe_delay_ns -= hd_later_ns;
	}
	return plan;
}
