/*
 * A random rig for the benches of triangulation: cameras in front of a ball of space, all looking
 * into it, each with its own lens; the true projection beside the tables that the tracker uses.
 */
#pragma once

#include "base/rng.h"
#include "track/observe.h"
#include "track/view.h"

#define RIG_WIDTH_PX 1280
#define RIG_HEIGHT_PX 1024

struct rig_camera {
	struct pose rt_cam_stage;
	double focal_px, bend; /* radial distortion, of the squared tangent */
};

struct random_rig {
	uint32_t count;
	struct rig_camera cameras[CAMERA_MAX];
	struct view views[CAMERA_MAX];
};

/* The ball is around the origin; cameras stand 0.8 to 2.5 m from it, or as much more as a larger
 * ball needs. Ends the program when there is no memory. */
void random_rig_init(struct random_rig *rig, struct rng *rng, uint32_t count, double ball_m);
void random_rig_finish(struct random_rig *rig);

/* The truth, without tables. The point must be in front of the camera. */
void rig_camera_project(const struct rig_camera *camera, struct vec3 p_stage_m, double pixel[2]);

/* Of the truth, by central differences; 1/m. */
void rig_camera_slopes(const struct rig_camera *camera, struct vec3 p_stage_m, double slopes[2][3]);

struct vec3 random_in_ball(struct rng *rng, double radius_m);
