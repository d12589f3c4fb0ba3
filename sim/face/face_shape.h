/*
 * The surface of a head: an ellipsoid with bumps added along the radius. A place on it is named by
 * its azimuth (towards the subject's left) and elevation as seen from the head's middle.
 */
#pragma once

#include "base/geometry.h"
#include "base/rng.h"

#define FACE_RELIEF_MAX 12

struct face_shape {
	struct vec3 axes_m;
	double relief_scale[FACE_RELIEF_MAX];
};

struct face_shape face_shape_make(struct rng *rng);
struct vec3 face_surface(const struct face_shape *shape, double azimuth_deg, double elevation_deg);
struct vec3 face_surface_normal(const struct face_shape *shape, double azimuth_deg,
				double elevation_deg);

/* exp(-d^2 / 2), d in units of the two sigmas. */
double face_lobe(double azimuth_deg, double elevation_deg, double sigma_azimuth_deg,
		 double sigma_elevation_deg);
