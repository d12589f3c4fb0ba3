/*
 * Some seconds of a running station, or of a recording: the spots of every camera and the points
 * that were made of them, shot by shot. What a rig is refined from, and where an L-frame is found.
 */
#pragma once

#include "track/observe.h"

struct seen_spot {
	uint32_t shot; /* index into the shots */
	uint32_t camera;
	double px[2], sigma_px;
};

struct seen_point {
	uint32_t shot;
	int label; /* LABEL_NONE: without a name */
	uint32_t camera_mask;
	struct vec3 p_stage_m;
};

/* A zeroed one is empty. Spots and points stand in the order of their shots. */
struct marker_shots {
	uint32_t shot_count;
	uint32_t spot_count, spot_room, point_count, point_room;
	struct seen_spot *spots;   /* without saturated, merged and cut ones */
	struct seen_point *points; /* of three or more cameras; of two those without a name */
};

/* Returns 0 or -ENOMEM. */
int marker_shots_add(struct marker_shots *shots, const struct shot *shot,
		     const struct marker_set *set);
void marker_shots_finish(struct marker_shots *shots);
