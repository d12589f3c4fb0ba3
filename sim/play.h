/*
 * Plays a scene shot by shot through the tracker, in this process and without any device, so that
 * every shot can be scored against the truth.
 */
#pragma once

#include <stdint.h>

#include "base/diag.h"
#include "config/rig.h"
#include "sim/blob_play.h"
#include "sim/cameras.h"
#include "sim/picture.h"
#include "sim/score.h"
#include "sim/world/scene.h"
#include "track/blobs/blobs.h"
#include "track/tracker.h"

/* Thread CPU time of the shots played so far. */
struct sim_play_cost {
	double truth_us, blobs_us, tracker_us; /* blobs: with their pictures, if any */
};

/* A scene, the rig that looks at it and a tracker on that rig. Large: not for a stack. */
struct sim_play {
	struct sim_scene *scene;
	struct rig rig;
	struct tracker_rig tracker_rig;
	struct tracker_scratch *scratch;
	struct tracker_state state;
	/* at pixel level, else NULL */
	struct sim_picture *pictures[SIM_CAMERA_MAX];
	struct blob_finder *finders[SIM_CAMERA_MAX];
	struct blob_set sets[CAMERA_MAX];
	struct sim_truth before; /* of the shot before, where a fault shows that */
	struct sim_truth truth;  /* of the last shot played */
	struct marker_set set;   /* what the tracker made of it */
	struct sim_play_cost cost;
};

/* Returns 0 or a negative errno with a message; then nothing is held. Control thread. */
int sim_play_init(struct sim_play *play, const struct sim_options *options, struct diag *diag);
void sim_play_finish(struct sim_play *play); /* a zeroed one is fine */

/* From now on its cameras have pictures, in which their blobs are found. Returns 0 or a negative
 * errno with a message. Control thread. */
int sim_play_use_pixels(struct sim_play *play, enum sim_noise noise, struct diag *diag);

/* Plays one shot with the scene's faults; cameras in `missing_mask` send nothing either. `blobs` is
 * for the blob level alone. Returns the tracker's thread CPU time. */
double sim_play_shot_us(struct sim_play *play, const struct blob_play *blobs, uint64_t shot,
			uint32_t missing_mask);
