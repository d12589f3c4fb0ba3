/*
 * A calibration made twice, each time from half of the board's poses, and each half judged by views
 * that it has not seen: what overfits shows here.
 */
#pragma once

#include "base/diag.h"
#include "calib/solve/solve.h"
#include "calib/solve/volume.h"

struct cross_check {
	double held_out_rms_px; /* as solution.rms_px, of the poses that the cameras were not made
				   from */
	double halves_differ_m; /* rms over the volume, rigidly aligned */
};

/* The halves are solved side by side, from the whole solution. Returns 0, -ETIMEDOUT, -EINVAL when
 * a half is too little to solve (with a message), or another negative errno. */
int cross_check(struct cross_check *check, const struct observations *observations,
		const struct seed *seed, const struct solution *solution,
		const struct volume *volume, const struct solve_settings *settings,
		struct diag *diag);
