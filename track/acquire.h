/*
 * Finds the head from nothing: three rigid markers of the layout against every triangle of points
 * with the same sides, the pose checked by how many markers then lie on points and how many points
 * are explained. Where too few markers are rigid, wide triangles of skin markers are tried, some
 * each shot. Pure, deterministic, bounded per shot.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/layout.h"
#include "track/match.h"

#define ACQUIRE_POINT_MAX 192 /* more points than that: the best confirmed ones are used */
#define ACQUIRE_PAIR_MAX (ACQUIRE_POINT_MAX * (ACQUIRE_POINT_MAX - 1) / 2)

struct acquire_scratch {
	int point_count;
	struct vec3 points_stage_m[ACQUIRE_POINT_MAX];
	int pair_count;
	struct acquire_pair {
		float distance_m;
		uint16_t a, b;
	} pairs[ACQUIRE_PAIR_MAX]; /* by distance */
};

/* `cursor` says where the search goes on in the next shot. Returns true with the pose when one fits
 * and no other fits nearly as well. */
bool acquire_head(struct acquire_scratch *scratch, const struct layout *layout,
		  const struct point *points, uint32_t point_count, uint32_t *cursor,
		  struct pose *rt_stage_head);
