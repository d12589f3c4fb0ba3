/*
 * Finds heads from nothing: three rigid markers of the layout against every triangle of points with
 * the same sides, the pose checked by how many markers then lie on points and how many points there
 * are explained. Where too few markers are rigid, wide triangles of skin markers are tried, some
 * each shot. Faces are alike: what is found may be another actor's. Pure, deterministic, bounded
 * per shot.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/match/nearby.h"
#include "track/tracker_state.h"

#define ACQUIRE_PAIR_MAX 80000
#define ACQUIRE_BIN_M 0.0005
#define ACQUIRE_SIDE_MAX_M 0.25 /* of a triangle; a face is smaller */
#define ACQUIRE_BIN_COUNT 500

struct acquire_scratch {
	struct nearby free; /* the points that no found frame explains */
	int pair_count;
	struct acquire_pair {
		uint16_t a, b;
	} pairs[ACQUIRE_PAIR_MAX]; /* by the bin of their distance */
	int bin_start[ACQUIRE_BIN_COUNT + 1];
};

/* Once per shot, before the heads are searched for. `taken[p]`: point p is explained. */
void acquire_begin(struct acquire_scratch *scratch, const struct point *points,
		   uint32_t point_count, const bool *taken);

#define ACQUIRE_PLACE_MAX 8 /* faces among the free points */

/* Where something like the frame's head is, others' heads among it: the best pose at each place
 * when no other there does nearly as well. The frame's cursor says where the search goes on in the
 * next shot. Returns how many. */
int acquire_heads(const struct acquire_scratch *scratch, struct tracker_state *state, int frame,
		  struct pose rt_stage_head[ACQUIRE_PLACE_MAX]);
