/*
 * What hides what: ellipsoids between a place and a camera.
 */
#pragma once

#include <stdbool.h>

#include "sim/world/scene.h"

/* `rt_stage_shape`: the ellipsoid's axes and middle. */
struct sim_truth_occluder occluder_make(const struct pose *rt_stage_shape, struct vec3 axes_m);

/* Does the segment meet the ellipsoid on its way out of it or past it? One that starts inside and
 * only leaves does not. */
bool occluder_hides(const struct sim_truth_occluder *occluder, struct vec3 from, struct vec3 to);

/* The same with `to` already taken to the unit sphere. */
struct vec3 occluder_to_unit(const struct sim_truth_occluder *occluder, struct vec3 p_stage_m);
bool occluder_hides_from(const struct sim_truth_occluder *occluder, struct vec3 from,
			 struct vec3 to_unit);

/* False when nothing within `radius_m` of `middle` can be hidden from `to`. */
bool occluder_matters(const struct sim_truth_occluder *occluder, struct vec3 middle,
		      double radius_m, struct vec3 to);
