/*
 * The finishing step of a calibration: its models also carry what they were made from, so that
 * mrcal-show-residuals and mrcal-show-projection-uncertainty open them. It needs Python with mrcal
 * (package python3-mrcal) and is left out without; nothing else needs it.
 */
#pragma once

#include "ctl/calibrate/calibrate_make.h"

/* Says on stderr what came of it. The models' numbers stay as they are, and so does the revision;
 * when something fails, all models stay as they are. */
void calibrate_finish(const struct calibrate_making *making);
