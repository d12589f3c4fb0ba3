/*
 * What a scene is made of, for the files of this room; others see sim/world/scene.h.
 */
#pragma once

#include "sim/board/board.h"
#include "sim/cameras.h"
#include "sim/face/body.h"
#include "sim/face/face.h"
#include "sim/face/motion.h"
#include "sim/face/performance.h"
#include "sim/face/script.h"
#include "sim/happen.h"
#include "sim/world/scene.h"

/* Its markers: the face's, then the body's. */
struct scene_actor {
	struct face face;
	struct body body;
	struct motion motion;
	struct performance performance;
	bool has_body;
	uint32_t first_marker, marker_count; /* of the layout */
	uint32_t first_occluder;             /* its skull; then its nose */
};

/* What a picture of a marker depends on, beside the layout. */
struct scene_marker {
	uint32_t actor;
	double reflectivity; /* 1 = nominal */
	bool hemisphere;     /* stands on its base; its radius is half the diameter */
	double facing_min;   /* cosine to the camera, from which on it shines back */
	int exempt;          /* the occluder that it is a part of, or -1 */
};

/* The image's borders in the plane z = 1 before the camera. What is inside `inner` is in the image,
 * what is outside `outer` is not; left, right, top, bottom. */
struct scene_window {
	double inner[4], outer[4];
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
	struct happenings happenings;
	uint32_t camera_count; /* IR */
	uint32_t hd_count;
	uint32_t hd_divider, hd_phase;
	int64_t hd_after_ir_ns, hd_row_ns;
	struct sim_board board;                    /* when the script wants one */
	struct sim_camera cameras[SIM_DEVICE_MAX]; /* the IR ones, then the HD ones */
	struct scene_window windows[SIM_DEVICE_MAX];
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

/* The actors of the script with their markers and the combined layout. Returns 0 or -EINVAL with a
 * message. */
int scene_cast(struct sim_scene *scene, struct diag *diag);

/* The marker as the layout tells it; m counts within the actor. */
const struct layout_marker *scene_actor_marker(const struct scene_actor *actor, uint32_t m);

/* Where the image of each camera ends. */
void scene_set_windows(struct sim_scene *scene);

/* The truth without visible_mask, which stays 0: a renderer asks for its own camera alone. */
void scene_pose_markers(const struct sim_scene *scene, double time_s, struct sim_truth *out);

/* Does the camera see the marker? Then where its middle falls and the cosine of the angle between
 * its normal and the camera. */
bool scene_camera_sees(const struct sim_scene *scene, const struct sim_truth *truth,
		       uint32_t camera, uint32_t marker, double pixel[2], double *facing);

/* The same of a ghost: the glint's place on its surface for this camera, and how bright it is. */
bool scene_camera_sees_ghost(const struct sim_scene *scene, const struct sim_truth *truth,
			     uint32_t camera, uint32_t ghost, struct vec3 *p_stage_m,
			     double pixel[2], double *brightness);
