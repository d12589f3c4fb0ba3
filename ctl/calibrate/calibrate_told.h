/*
 * What pictures of a board show and its corners do not: each with its remedy.
 */
#pragma once

#include "base/diag.h"
#include "config/calibration.h"
#include "ctl/calibrate/calibrate_search.h"

/* Cameras from which no calibration can be made. Returns 0 or -EINVAL with messages. Warns on
 * stderr of those that were not exposed with the others. */
int calibrate_check_pictures(const struct observations *observations,
			     const struct picture_counts *counts, const struct board *board,
			     double blur_max_px, struct diag *diag);
