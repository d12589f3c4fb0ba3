/*
 * Spots as a blob finder would report them, before it errs: what one spot comes to, and what
 * becomes of spots that run into each other.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sim/render/spot.h"
#include "sim/render/spot_bound.h"
#include "sim/world/scene_parts.h"

struct play_spot {
	double x_px, y_px, sigma_px;
	double spread_px2[3]; /* of its light: xx xy yy */
	double light;         /* weight in a merged spot */
	double reach_px;      /* radius of what is above the threshold */
	double core_px;       /* two spots nearer than both of these together have no saddle */
	double area_px2, peak_grey;
	uint32_t flags; /* enum blob_flag */
};

struct play_camera {
	const struct sim_camera *eye;
	int kind; /* enum sim_optics */
	const struct bound_table *bounds;
	double blur_px, noise_gain; /* of sigma, by ambient light */
};

struct play_camera play_camera_of(const struct sim_scene *scene, uint32_t camera, double time_s);

/* False when it is too faint to be found. */
bool play_spot_of(const struct play_camera *camera, const struct spot *spot, struct play_spot *out);

/* Merges what has no saddle between and doubts what touches; the spots come out from top to bottom.
 * Returns how many are left. `merge_px` above 0 is the distance instead. */
uint32_t play_spots_merge(struct play_spot *spots, uint32_t count, double merge_px);
