/*
 * The part of a demonstration in which a station without a rig gets one: stagectl calibrates it,
 * with its progress for all to see, and then it runs.
 */
#pragma once

#include <signal.h>

#include "demo/stand.h"

struct calibration_report {
	bool passed;
	double seconds; /* from the first shot to the rig in force */
	uint32_t poses;
	double rms_px, worst_mm;
};

/* The station is there, or comes up. Returns 0 or a negative errno with a message; -EINTR when
 * `*stop`. */
int demo_calibrate(struct calibration_report *report, struct stand *stand,
		   const volatile sig_atomic_t *stop, struct diag *diag);
