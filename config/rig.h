/*
 * A rig: a directory with one mrcal NAME.cameramodel per camera, whose reference frame is the
 * stage.
 */
#pragma once

#include <stdint.h>

#include "base/diag.h"
#include "track/layout.h"
#include "track/view.h"

struct rig {
	uint32_t camera_count;
	uint32_t number;   /* as stagectl calibrate list has it; 0: not one of those */
	char revision[17]; /* hex digest of the models' numbers: names this calibration in the
			      stream */
	char names[CAMERA_MAX][NAME_BYTES];
	struct view views[CAMERA_MAX]; /* owned */
};

/* NNNN of "RIG.d/NNNN" or of "NNNN"; 0: no revision's place. */
uint32_t rig_revision_number(const char *place);

/* Loads the models of the named cameras, in that order, all of them from where a link `dir` leads
 * now. Every missing or malformed file is one
 * message that names file and field. Returns 0, -EINVAL or -ENOMEM; on failure nothing is held. */
int rig_load(struct rig *rig, const char *dir, const char (*names)[NAME_BYTES], uint32_t count,
	     struct diag *diag);
void rig_finish(struct rig *rig); /* a zeroed rig is fine */

/* Says so when a camera's images are not the size its model was made for. Returns 0 or -EINVAL. */
int rig_check_size(const struct rig *rig, uint32_t camera, int width_px, int height_px,
		   struct diag *diag);
