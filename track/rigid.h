/*
 * The pose that best takes one set of points to another: weighted least squares, closed form by
 * quaternions (Horn 1987), the largest eigenvector by Jacobi rotations. Pure and real-time safe.
 */
#pragma once

#include "base/geometry.h"

struct rigid_pair {
	struct vec3 from, to;
	double weight; /* 1 / sigma^2 */
};

/* At least three pairs that are not on one line. Returns 0 or -EDOM. */
int rigid_fit(const struct rigid_pair *pairs, int count, struct pose *rt_to_from);

/* Distance of one pair under a pose. */
static inline double rigid_error(const struct rigid_pair *pair, const struct pose *rt_to_from)
{
	return vec3_distance(pose_apply(rt_to_from, pair->from), pair->to);
}
