/*
 * A scene played at blob level: what a good blob finder would report of each camera's picture,
 * without the picture: markers, ghosts and lamps, merged, clipped and cut off as they would be,
 * with errors as large as their spots allow. Hundreds of times faster than pixels, for long runs.
 */
#pragma once

#include <stdint.h>

#include "sim/faults.h"
#include "sim/world/scene.h"

/* All zero: as the scene's optics have it. */
struct blob_play {
	double sigma_px;   /* of a blob's place; 0 = by its spot, near the Cramer-Rao bound */
	double claimed_px; /* what each blob says its sigma is; 0 = the truth */
	double merge_px;   /* spots nearer than this are one blob; 0 = by their sizes */
	double lost_share; /* of the visible spots that are not found */
	int stray_count;   /* bright spots per camera and shot at random places */
};

/* Fills the blobs and times of shot `shot` as camera `camera` sees it; the same arguments give the
 * same blobs. `truth` is the scene's at that shot. Any thread. */
void blob_play_camera(const struct blob_play *play, const struct sim_scene *scene,
		      const struct sim_truth *truth, uint64_t shot, uint32_t camera,
		      struct blob_set *set);

/* What faults of the exposure make of a camera's blobs: none without strobe, or broad and saturated
 * ones. */
void blob_play_fault(struct blob_set *set, sim_fault_mask faults);
