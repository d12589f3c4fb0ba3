/*
 * A stage as its files describe it: config, layout and rig, loaded and checked together, ready for
 * the tracker. No device is touched.
 */
#pragma once

#include "config/config.h"
#include "config/rig.h"

#define VIEW_NONE UINT32_MAX

/* Large: keep it on the heap or static. */
struct stage {
	struct config config;
	struct layout layout;
	bool has_rig;     /* else there is none yet: nothing can be tracked */
	struct rig rig;   /* of the IR cameras, in the config's order; without: image sizes alone */
	uint32_t ir_mask; /* bit c: the config's camera c is tracked */
	uint32_t view_index[CAMERA_MAX]; /* the config's camera c in the rig, or VIEW_NONE (HD) */
	struct tracker_rig tracking;     /* borrows rig and layout */
};

/* Loads all that the config names; one run reports every error. Returns 0, -EINVAL, -ENOMEM or the
 * errno of reading a file; on failure nothing is held. */
int stage_load(struct stage *stage, const char *config_path, struct diag *diag);

/* The same, with the drivers asked about addresses (config.h). */
int stage_load_for(struct stage *stage, const char *config_path,
		   const struct config_drivers *drivers, struct diag *diag);

/* The same for who can make a rig: that its directory does not exist is no error. */
int stage_load_to_calibrate(struct stage *stage, const char *config_path, struct diag *diag);

/* Loads the config's rig anew, for the same cameras with the same image sizes; `rig` is where it
 * stays, `tracking` borrows it and the stage's layout. Errors as above. Any one thread. */
int stage_load_rig_again(const struct stage *stage, struct rig *rig, struct tracker_rig *tracking,
			 struct diag *diag);
void stage_finish(struct stage *stage); /* a zeroed stage is fine */
