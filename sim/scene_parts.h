/*
 * What a scene is made of, for the files of this room; others see sim/scene.h.
 */
#pragma once

#include "sim/board.h"
#include "sim/cameras.h"
#include "sim/face.h"
#include "sim/motion.h"
#include "sim/scene.h"
#include "sim/script.h"

struct scene_actor {
	struct face face;
	struct motion motion;
};

/* What a picture of a marker depends on, beside the layout. */
struct scene_marker {
	uint32_t actor;
	double reflectivity; /* 1 = nominal */
	bool hemisphere;     /* stands on its base; its radius is half the diameter */
};

/* A camera from some time on. */
struct scene_bump {
	const struct sim_fault *fault; /* borrowed from the script */
	uint32_t camera;
	struct sim_camera bumped;
};

struct sim_scene {
	struct sim_script script; /* with the options' values in it */
	uint64_t seed;
	double rate_hz;
	int64_t period_ns;
	struct layout layout;                   /* of all actors */
	struct scene_marker markers[LABEL_MAX]; /* in the layout's order */
	uint32_t actor_count;
	struct scene_actor actors[SIM_ACTOR_MAX];
	uint32_t camera_count; /* IR */
	uint32_t hd_count;
	uint32_t hd_divider, hd_phase;
	int64_t hd_after_ir_ns, hd_row_ns;
	struct sim_board board;                    /* when the script wants one */
	struct sim_camera cameras[SIM_DEVICE_MAX]; /* the IR ones, then the HD ones */
	uint32_t bump_count;
	struct scene_bump *bumps; /* owned; NULL without any */
};

/* Once cameras and script stand. Returns 0 or -ENOMEM. */
int scene_bump_cameras(struct sim_scene *scene);

/* The camera as it stands at that time: `cameras` has it as the rig does. */
const struct sim_camera *scene_camera_at(const struct sim_scene *scene, uint32_t camera,
					 double time_s);

/* When camera `camera`, IR or HD, exposes shot `shot`. */
struct exposure scene_exposure(const struct sim_scene *scene, uint32_t camera, uint64_t shot);

/* The truth without visible_mask, which stays 0: a renderer asks for its own camera alone. */
void scene_pose_markers(const struct sim_scene *scene, double time_s, struct sim_truth *out);

/* Does the camera see the marker? Then where its middle falls and the cosine of the angle between
 * its normal and the camera. */
bool scene_camera_sees(const struct sim_scene *scene, const struct sim_truth *truth,
		       uint32_t camera, uint32_t marker, double pixel[2], double *facing);
