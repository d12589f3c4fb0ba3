/*
 * What a rig's rig.yaml says that it is worth: for lists of revisions, not for the station.
 */
#pragma once

#include <stdbool.h>

#include "base/diag.h"

#define RIG_WORTH_TEXT 64

/* Text is "", a number NaN or 0, where it does not say. */
struct rig_worth {
	char revision[RIG_WORTH_TEXT], software[RIG_WORTH_TEXT];
	char made_by[RIG_WORTH_TEXT], made_from[RIG_WORTH_TEXT];
	bool failed; /* its limits */
	bool judged;
	int poses;
	double rms_px, held_out_px, worst_mm;
};

/* Keys that it does not know are passed over. Returns 0, or a negative errno with messages
 * "file:line:column: field: what is wrong". */
int rig_worth_load(struct rig_worth *worth, const char *path, struct diag *diag);
