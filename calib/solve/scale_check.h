/*
 * A print that is out of scale alike in both directions shows in no picture: the whole rig is too
 * large or too small. It shows beside a rig from before, when cameras stand where they stood.
 */
#pragma once

#include <stdbool.h>

#include "base/diag.h"
#include "calib/solve/solve.h"
#include "config/rig.h"

/* True, with a message, when the distances between cameras have all changed by the same factor,
 * 0.3 % or more. Cameras are matched by name; fewer than three in common say nothing. */
bool scale_has_changed(const struct observations *observations, const struct solution *solution,
		       const struct rig *before, double *factor, struct diag *diag);
