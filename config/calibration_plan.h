/*
 * By what light the board is waved: a plan with few and long pulses, in which IR and HD cameras are
 * exposed together, each shot of all cameras.
 */
#pragma once

#include "config/calibration.h"
#include "drivers/trigger.h"

/* `own` is the plan of the running station: delays and what the strobe survives are kept, and a
 * strobe that it does not use is not used. */
struct trigger_plan calibration_plan(const struct calibration *calibration,
				     const struct trigger_plan *own);
