/*
 * The scene's cameras: where they stand, their lenses, and their mrcal model files.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "base/geometry.h"
#include "base/rng.h"
#include "sim/face/script.h"
#include "track/layout.h"

#define SIM_CAMERA_MIN 4
#define SIM_CAMERA_MAX 24
#define SIM_HD_MAX 3
#define SIM_DEVICE_MAX (SIM_CAMERA_MAX + SIM_HD_MAX)

/* Control points of a splined lens each way; some 120 px apart, so that it bends where OPENCV8
 * cannot follow. */
#define SIM_SPLINE_SIDE 16
#define SIM_INTRINSICS_MAX (4 + 2 * SIM_SPLINE_SIDE * SIM_SPLINE_SIDE)

struct sim_camera {
	char name[NAME_BYTES];
	int width_px, height_px;
	struct pose rt_cam_stage;
	struct vec3 centre_stage_m;
	double range_m;    /* to what it looks at and is focused on */
	double aperture_m; /* diameter of the lens's entrance pupil */
	double focal_px;
	int lens;                              /* enum sim_lens */
	double intrinsics[SIM_INTRINSICS_MAX]; /* fx fy cx cy, then the distortions */
};

/* Places `count` IR cameras as the script says: on an arc in front of its first actor, or along the
 * walls of a room around all of them. */
void sim_cameras_init(struct sim_camera *cameras, uint32_t count, const struct sim_script *script,
		      uint64_t seed);

/* Places `count` HD cameras that fill their pictures with a face, from in front and beside: all
 * with the first actor's, or in a room each with another actor's. */
void sim_hd_cameras_init(struct sim_camera *cameras, uint32_t count,
			 const struct sim_script *script, uint64_t seed);

/* Gives the camera a lens of nearly that focal length. */
void sim_camera_set_lens(struct sim_camera *camera, int lens, double nominal_focal_px,
			 struct rng *rng);

/* False when the point is behind the camera. */
bool sim_camera_project(const struct sim_camera *camera, struct vec3 p_stage_m, double pixel[2]);

/* Diameter of the disc that the lens makes of a point at that range, which is out of focus. */
double sim_camera_defocus_px(const struct sim_camera *camera, double range_m);

/* Writes the model with 17 digits, so that reading it back gives the same numbers. */
int sim_camera_write(const struct sim_camera *camera, const char *path, struct diag *diag);
