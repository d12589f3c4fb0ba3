/*
 * From what was seen of the board to a rig in force: solved, judged, stored as a new revision with
 * its report. Until it has passed, nothing of the rig from before is touched.
 */
#pragma once

#include <jansson.h>
#include <limits.h>

#include "calib/board/coverage.h"
#include "calib/board/where_next.h"
#include "calib/report/verdict.h"
#include "calib/rig/before.h"
#include "calib/solve/cross_check.h"
#include "calib/solve/uncertainty.h"
#include "config/calibration.h"

struct calibrate_making {
	/* set by the caller; borrowed */
	const char *rig_dir, *kept_path; /* the corners, kept; they move into the revision */
	const char *lens;
	bool accept_scale;
	const struct calibration *calibration;
	const struct observations *observations;
	const struct camera_coverage *coverage; /* per camera */
	/* found; owned */
	struct rig before;
	uint32_t before_number;
	struct seed seed;
	struct solution solution;
	struct volume volume;
	struct uncertainty uncertainty;
	struct cross_check check;
	struct verdict verdict;
	struct where_next worst;
	struct camera_move moves[CAMERA_MAX];
	struct pose rt_stage_ref;
	double scale;
	bool scale_refused;
	uint32_t number;
	char revision[17], revision_dir[PATH_MAX];
};

/* Returns 0, passed or not, or a negative errno with messages. */
int calibrate_make(struct calibrate_making *making, struct diag *diag);
void calibrate_making_finish(struct calibrate_making *making); /* a zeroed one is fine */

/* What came of it: for people, and the same as JSON, a new reference. */
void calibrate_making_print(const struct calibrate_making *making);
json_t *calibrate_making_json(const struct calibrate_making *making);
