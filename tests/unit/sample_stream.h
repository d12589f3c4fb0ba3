/*
 * A made-up station for the tests of the stream: two cameras, a layout, and marker sets whose
 * every number follows from shot and label, so that a receiver can check them.
 */
#pragma once

#include <stdio.h>
#include <string.h>

#include "protocol/encode.h"

#define SAMPLE_LABELS 74

static inline void sample_layout(struct layout *layout)
{
	memset(layout, 0, sizeof(*layout));
	layout->actor_count = 1;
	layout->actors[0] = (struct layout_actor){"anna", 0, SAMPLE_LABELS};
	layout->marker_count = SAMPLE_LABELS;
	for (uint32_t i = 0; i < SAMPLE_LABELS; i++) {
		struct layout_marker *marker = &layout->markers[i];

		snprintf(marker->name, NAME_BYTES, "marker_%u", i);
		strcpy(marker->group, i < 4 ? "band" : "face");
		marker->rigid = i < 4;
		marker->neutral_m = (struct vec3){0.001 * i, -0.002 * i, 0.003 * i};
		marker->diameter_m = 0.003;
	}
}

static inline struct stream_description sample_description(const struct layout *layout)
{
	return (struct stream_description){
		.station_version = "0.1.0",
		.rig_revision = "00c0ffee00c0ffee",
		.period_ns = 8333333,
		.camera_count = 2,
		.cameras = {{"ir1", false, 1280, 1024}, {"hd1", true, 1920, 1080}},
		.layout = layout};
}

/* Every tenth label is missing, every tenth plus one is predicted; `unlabelled` come behind. */
static inline void sample_set(struct marker_set *set, uint64_t shot, uint32_t unlabelled)
{
	memset(set, 0, sizeof(*set));
	set->shot = shot;
	set->mid_exposure_ns = 1000000000 + (int64_t)shot * 8333333;
	set->uncertainty_ns = 1500;
	set->arrival_ns = set->mid_exposure_ns + 1000000;
	set->found_ns = set->mid_exposure_ns + 1200000;
	set->solved_ns = set->mid_exposure_ns + 1500000;
	set->camera_count = 2;
	set->missing_mask = 2;
	set->label_count = SAMPLE_LABELS;
	set->marker_count = SAMPLE_LABELS + unlabelled;
	set->head_count = 1;
	set->heads[0] = (struct head){.valid = 1,
				      .rigid_count = 4,
				      .jig_slip = 1,
				      .slip_m = 0.003,
				      .rt_stage_head = POSE_IDENTITY,
				      .residual_m = 0.0001};
	set->heads[0].rt_stage_head.t = (struct vec3){0.1, 0.2, 1.5};
	for (uint32_t i = 0; i < set->marker_count; i++) {
		struct marker *marker = &set->markers[i];

		marker->label = i < SAMPLE_LABELS ? (int16_t)i : LABEL_NONE;
		marker->status = i % 10 == 0   ? MARKER_MISSING
				 : i % 10 == 1 ? MARKER_PREDICTED
					       : MARKER_MEASURED;
		marker->p_stage_m = (struct vec3){0.001 * i, 1e-6 * (double)shot, 1.0 / (i + 1)};
		for (int k = 0; k < 6; k++)
			marker->cov_m2[k] = 1e-10 * (k + 1);
		marker->residual_px = 0.25f;
		marker->camera_mask = 0x10203;
		marker->camera_count = 4;
		if (i >= SAMPLE_LABELS) {
			marker->flags = MARKER_GHOST;
			continue;
		}
		marker->flags = marker->status == MARKER_MISSING
					? MARKER_GONE
					: MARKER_STABILISED | MARKER_NORMALISED;
		marker->confidence = 0.875f;
		marker->stabilised_m[0] = 0.25f * (float)i;
		marker->normalised_m[2] = -0.5f * (float)i;
	}
}
