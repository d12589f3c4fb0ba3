/*
 * The spot that a marker makes on a camera's sensor, of an IR camera or of an HD camera with a ring
 * light.
 */
#pragma once

#include "sim/scene_parts.h"
#include "sim/spot.h"

/* Brightness that gives a nominal face marker `peak_grey` when it faces the camera at its range. */
double marker_brightness(const struct sim_camera *camera, double peak_grey, double blur_sigma_px);

/* `pixel` and `facing` as scene_camera_sees() found them. */
struct spot marker_spot(const struct sim_scene *scene, const struct sim_truth *truth,
			uint32_t camera, uint32_t marker, const double pixel[2], double facing,
			double brightness);
