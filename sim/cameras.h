/*
 * The scene's cameras: where they stand, their lenses, and their mrcal model files.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "base/geometry.h"
#include "track/layout.h"

#define SIM_CAMERA_MIN 4
#define SIM_CAMERA_MAX 8
#define SIM_HD_MAX 3
#define SIM_DEVICE_MAX (SIM_CAMERA_MAX + SIM_HD_MAX)
#define SIM_INTRINSICS 12 /* LENSMODEL_OPENCV8: fx fy cx cy, then 8 distortions */

struct sim_camera {
	char name[NAME_BYTES];
	int width_px, height_px;
	struct pose rt_cam_stage;
	struct vec3 centre_stage_m;
	double range_m; /* to the seated head */
	double intrinsics[SIM_INTRINSICS];
};

/* Places `count` IR cameras on an arc in front of the actor. */
void sim_cameras_init(struct sim_camera *cameras, uint32_t count, uint64_t seed);

/* Places `count` HD cameras that fill their pictures with the face, from in front and beside. */
void sim_hd_cameras_init(struct sim_camera *cameras, uint32_t count, uint64_t seed);

/* False when the point is behind the camera. */
bool sim_camera_project(const struct sim_camera *camera, struct vec3 p_stage_m, double pixel[2]);

/* Writes the model with 17 digits, so that reading it back gives the same numbers. */
int sim_camera_write(const struct sim_camera *camera, const char *path, struct diag *diag);
