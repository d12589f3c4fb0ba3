/*
 * Projected truth plus noise; spots too close together are seen as one, in their middle.
 */
#include "sim/blob_play.h"

#include <math.h>

#include "base/rng.h"
#include "sim/scene_parts.h"

static void add_blob(struct blob_set *set, double x_px, double y_px, double sigma_px)
{
	if (set->blob_count == BLOB_MAX) {
		set->blobs_lost++;
		return;
	}
	set->blobs[set->blob_count++] = (struct blob){.x_px = (float)x_px,
						      .y_px = (float)y_px,
						      .sigma_px = (float)sigma_px,
						      .area_px2 = 12,
						      .peak = 120};
}

/* Joins a spot to a blob within reach; the joined place is off by far more than the noise. */
static bool join_blob(struct blob_set *set, double merge_px, const double pixel[2])
{
	for (uint32_t b = 0; b < set->blob_count; b++) {
		struct blob *blob = &set->blobs[b];

		double dx = blob->x_px - pixel[0], dy = blob->y_px - pixel[1];

		if (dx * dx + dy * dy >= merge_px * merge_px)
			continue;
		blob->x_px = (float)(0.5 * (blob->x_px + pixel[0]));
		blob->y_px = (float)(0.5 * (blob->y_px + pixel[1]));
		blob->sigma_px = (float)(0.3 * merge_px);
		blob->flags |= BLOB_MERGED;
		return true;
	}
	return false;
}

void blob_play_camera(const struct blob_play *play, const struct sim_scene *scene,
		      const struct sim_truth *truth, uint64_t shot, uint32_t camera,
		      struct blob_set *set)
{
	const struct sim_camera *eye = scene_camera_at(scene, camera, truth->time_s);
	struct rng rng;
	double claimed_px = play->claimed_px > 0 ? play->claimed_px : play->sigma_px;

	rng_init(&rng, scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15), 128 + camera);
	*set = (struct blob_set){.shot = shot,
				 .device_seq = shot,
				 .mid_exposure_ns = sim_scene_mid_exposure_ns(scene, shot),
				 .uncertainty_ns = 1000};
	for (uint32_t m = 0; m < truth->marker_count; m++) {
		double pixel[2];

		if (!(truth->markers[m].visible_mask & (UINT32_C(1) << camera)) ||
		    !sim_camera_project(eye, truth->markers[m].p_stage_m, pixel) ||
		    rng_uniform(&rng) < play->lost_share)
			continue;
		pixel[0] += play->sigma_px * rng_normal(&rng);
		pixel[1] += play->sigma_px * rng_normal(&rng);
		if (!join_blob(set, play->merge_px, pixel))
			add_blob(set, pixel[0], pixel[1], claimed_px);
	}
	for (int i = 0; i < play->stray_count; i++)
		add_blob(set, rng_uniform(&rng) * eye->width_px, rng_uniform(&rng) * eye->height_px,
			 claimed_px);
}

void blob_play_fault(struct blob_set *set, sim_fault_mask faults)
{
	if (faults & SIM_FAULT_BIT(SIM_FAULT_DARK))
		set->blob_count = 0;
	if (!(faults & SIM_FAULT_BIT(SIM_FAULT_STUCK_EXPOSURE)))
		return;
	for (uint32_t b = 0; b < set->blob_count; b++) {
		set->blobs[b].flags |= BLOB_SATURATED;
		set->blobs[b].area_px2 *= 2;
		set->blobs[b].peak = 240;
	}
}
