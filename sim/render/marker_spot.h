/*
 * The spots that markers and other bright things make on a camera's sensor, of an IR camera or of
 * an HD camera with a ring light.
 *
 * The truth is the projection of the disc's centre, and the image is drawn symmetrical about it.
 * In perspective the near half of a disc of radius R at range Z is a little larger, which shifts
 * the image's centre by f (R / Z)^2 sin(tilt) cos(tilt): at 1.3 m and f = 1600 px at most 0.0003 px
 * of 1.5 mm and 0.023 px of 14 mm. That is left out.
 */
#pragma once

#include "sim/render/spot.h"
#include "sim/world/scene_parts.h"

#define MARKER_PEAK_GREY 175.0 /* of the smallest markers, facing an IR camera at its range */

/* Brightness that gives the scene's smallest markers `peak_grey` when they face the camera at its
 * range. */
double marker_brightness(const struct sim_scene *scene, uint32_t camera, double peak_grey,
			 double blur_sigma_px);

/* A flat disc; false when its centre is behind the camera. */
bool disc_spot(const struct sim_camera *camera, struct vec3 centre_stage_m, struct vec3 normal,
	       double radius_m, double brightness, struct spot *out);

/* `pixel` and `facing` as scene_camera_sees() found them. */
struct spot marker_spot(const struct sim_scene *scene, const struct sim_truth *truth,
			uint32_t camera, uint32_t marker, const double pixel[2], double facing,
			double brightness);

/* A specular glint, `p_stage_m` and `value` as scene_camera_sees_ghost() found them: as a nominal
 * marker of that brightness. */
bool ghost_spot(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t camera,
		struct vec3 p_stage_m, double value, double brightness, struct spot *out);
