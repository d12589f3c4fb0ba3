/*
 * Writes a calibration as a rig: a directory of NAME.cameramodel with 17 digits, which read back as
 * the same numbers, and rig.yaml, which says what they were made from and what they are worth. The
 * same calibration gives the same bytes.
 */
#pragma once

#include "base/diag.h"
#include "base/geometry.h"
#include "calib/report/verdict.h"
#include "calib/solve/cross_check.h"
#include "calib/solve/solve.h"
#include "calib/solve/uncertainty.h"

struct rig_facts {
	const char *software; /* "stage 0.1.0" */
	const struct observations *observations;
	const struct solution *solution;
	const struct volume *volume;
	const struct uncertainty *uncertainty;
	const struct cross_check *cross_check;
	const struct verdict *verdict; /* NULL: not judged */
	struct pose rt_stage_ref;      /* takes camera 0's coordinates to the stage's */
};

/* Makes `dir`, whole or not at all. Before it gets its name it is loaded as the station would, so
 * that a lens that cannot be inverted is found here. `revision` gets what the station will call it.
 * Returns 0, -EEXIST when there is something at `dir`, -EINVAL when the station could not load it,
 * or another errno of writing; each with a message. */
int rig_write(const char *dir, const struct rig_facts *facts, char revision[17], struct diag *diag);
