/*
 * The trigger's plan of a face at 120 shots a second, for tests of the drivers that fire it.
 */
#pragma once

#include "base/clock.h"
#include "drivers/trigger.h"

#define USUAL_PERIOD_NS (NS_PER_S / 120)

static const struct trigger_plan usual_plan = {
	.period_ns = USUAL_PERIOD_NS,
	.ir_delay_ns = 20 * NS_PER_US,
	.ir_exposure_ns = 400 * NS_PER_US,
	.strobe_delay_ns = 70 * NS_PER_US,
	.strobe_width_ns = 250 * NS_PER_US,
	.strobe_duty_max = 0.1,
	.hd_divider = 4,
	.hd_phase = 1,
	.hd_delay_ns = 3 * NS_PER_MS,
	.hd_exposure_ns = 12 * NS_PER_MS, /* over more than one period */
};
