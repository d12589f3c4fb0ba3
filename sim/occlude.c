/*
 * Segments against ellipsoids, in the space where the ellipsoid is the unit sphere.
 */
#include "sim/occlude.h"

struct sim_truth_occluder occluder_make(const struct pose *rt_stage_shape, struct vec3 axes_m)
{
	struct sim_truth_occluder o = {.centre_stage_m = rt_stage_shape->t,
				       .radius_m = fmax(fmax(axes_m.x, axes_m.y), axes_m.z)};

	for (int i = 0; i < 3; i++) {
		o.to_unit[0][i] = rt_stage_shape->r[i][0] / axes_m.x;
		o.to_unit[1][i] = rt_stage_shape->r[i][1] / axes_m.y;
		o.to_unit[2][i] = rt_stage_shape->r[i][2] / axes_m.z;
	}
	return o;
}

struct vec3 occluder_to_unit(const struct sim_truth_occluder *o, struct vec3 p)
{
	struct vec3 d = vec3_sub(p, o->centre_stage_m);

	return (struct vec3){
		o->to_unit[0][0] * d.x + o->to_unit[0][1] * d.y + o->to_unit[0][2] * d.z,
		o->to_unit[1][0] * d.x + o->to_unit[1][1] * d.y + o->to_unit[1][2] * d.z,
		o->to_unit[2][0] * d.x + o->to_unit[2][1] * d.y + o->to_unit[2][2] * d.z};
}

bool occluder_hides_from(const struct sim_truth_occluder *o, struct vec3 from, struct vec3 to_unit)
{
	struct vec3 a = occluder_to_unit(o, from), d = vec3_sub(to_unit, a);
	double along = -vec3_dot(a, d), length2 = vec3_dot(d, d);

	if (along <= 0 || along >= length2)
		return false;
	return vec3_dot(a, a) * length2 - along * along < length2;
}

bool occluder_hides(const struct sim_truth_occluder *o, struct vec3 from, struct vec3 to)
{
	return occluder_hides_from(o, from, occluder_to_unit(o, to));
}

bool occluder_matters(const struct sim_truth_occluder *o, struct vec3 middle, double radius_m,
		      struct vec3 to)
{
	struct vec3 d = vec3_sub(to, middle), c = vec3_sub(o->centre_stage_m, middle);
	double along = vec3_dot(c, d), length2 = vec3_dot(d, d), reach_m = o->radius_m + radius_m;
	double room2 = vec3_dot(c, c) - reach_m * reach_m;

	if (along <= 0)
		return room2 < 0;
	if (along >= length2) {
		struct vec3 behind = vec3_sub(c, d);

		return vec3_dot(behind, behind) < reach_m * reach_m;
	}
	return room2 * length2 < along * along;
}
