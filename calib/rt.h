/*
 * Poses as mrcal has them: a rotation vector, then a translation.
 */
#pragma once

#include "base/geometry.h"

static inline struct pose pose_from_rt(const double rt[6])
{
	struct pose pose = pose_from_rotation_vector((struct vec3){rt[0], rt[1], rt[2]});

	pose.t = (struct vec3){rt[3], rt[4], rt[5]};
	return pose;
}

static inline void pose_to_rt(const struct pose *pose, double rt[6])
{
	struct vec3 r = pose_to_rotation_vector(pose);

	rt[0] = r.x;
	rt[1] = r.y;
	rt[2] = r.z;
	rt[3] = pose->t.x;
	rt[4] = pose->t.y;
	rt[5] = pose->t.z;
}
