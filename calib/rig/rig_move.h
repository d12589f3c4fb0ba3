/*
 * A rig's next revision with the same lenses, whose cameras stand elsewhere or in another stage
 * frame. All that a model file says beside its pose stays as it is written there.
 */
#pragma once

#include "base/diag.h"
#include "base/geometry.h"
#include "track/layout.h"

struct rig_move {
	const char *what;                /* the verb, one word: "refine" */
	const char *software;            /* "stage 0.1.0" */
	char details[2048];              /* lines of YAML for rig.yaml; may be empty */
	const char (*names)[NAME_BYTES]; /* of the IR cameras, as the station loads them */
	uint32_t count;
	/* where camera `name` stands from now on, who stood at rt_cam_stage; IR and HD cameras */
	struct pose (*pose)(const char *name, const struct pose *rt_cam_stage, const void *user);
	const void *user;
};

struct rig_moved {
	uint32_t number;
	char revision[17];
};

/* Writes the next revision of the rig in `rig_dir` and brings it into force. Returns 0, -EBUSY when
 * another program calibrates this rig, or another negative errno, with messages; then the rig stays
 * as it is. */
int rig_move(struct rig_moved *moved, const char *rig_dir, const struct rig_move *move,
	     struct diag *diag);
