/*
 * Plays a scene at blob level through the tracker and scores every shot against the truth.
 */
#pragma once

#include <stdbool.h>

#include "config/rig.h"
#include "sim/blob_play.h"
#include "sim/scene.h"
#include "tests/scenes/score.h"
#include "track/tracker.h"

/* A scene, the rig that looks at it and a tracker on that rig. */
struct stage {
	struct sim_scene *scene;
	struct rig rig;
	struct tracker_rig tracker_rig;
	struct tracker_scratch *scratch;
	struct tracker_state state;
	struct blob_set sets[CAMERA_MAX];
	struct sim_truth truth; /* of the last shot played */
	struct marker_set set;  /* what the tracker made of it */
};

/* Returns 0 or a negative errno, with the reason on standard error. */
int stage_init(struct stage *stage, const struct sim_options *options);
void stage_finish(struct stage *stage);

/* Plays one shot; cameras in `missing_mask` send nothing. Returns the tracker's thread CPU time. */
double stage_play_us(struct stage *stage, const struct blob_play *play, uint64_t shot,
		     uint32_t missing_mask);
