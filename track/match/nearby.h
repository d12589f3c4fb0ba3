/*
 * The points of one shot sorted along one axis, so that those near a place are found without a look
 * at all the others. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/match/match.h"

#define NEARBY_STRIP_COUNT 256

struct nearby {
	int count;
	struct vec3 p_stage_m[POINT_MAX]; /* by x */
	int16_t point[POINT_MAX];

	/* where in it to look: strips across x, of equal width */
	double x_first_m, strips_per_m;
	uint16_t strip_from[NEARBY_STRIP_COUNT + 1]; /* the first entry that is not before it */
};

/* Of the points with at least three views with a say, even if one was outvoted; without those whose
 * two or three used views contradict each other, and those that `skip` says, which may be NULL. */
void nearby_build(struct nearby *nearby, const struct point *points, uint32_t point_count,
		  const bool *skip);

/* The first entry whose x is not below, or one a little before it; walk on from there while x stays
 * within reach. */
int nearby_from(const struct nearby *nearby, double x_m);

/* The entry nearest to a place within `radius_m`, or -1. */
int nearby_nearest(const struct nearby *nearby, struct vec3 place_m, double radius_m,
		   double *distance2_m2);
