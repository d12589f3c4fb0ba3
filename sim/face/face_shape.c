/*
 * Bumps and hollows are Gaussian lobes; their heights and the ellipsoid vary with the seed.
 */
#include "sim/face/face_shape.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)

/* Those with an azimuth above 0 are mirrored. */
static const struct {
	double azimuth_deg, elevation_deg, sigma_azimuth_deg, sigma_elevation_deg, height_mm;
} RELIEF[] = {
	{0, -50, 42, 19, 19}, /* the lower face stands forward of the ellipsoid */
	{0, -19, 7, 9, 18},   /* nose tip */
	{0, -6, 6, 10, 8},    /* nose bridge */
	{14, 18, 12, 5, 3},   /* brow ridge */
	{18, 4, 8, 6, -5},    /* eye socket */
	{36, -10, 11, 9, 4},  /* cheek bone */
	{0, -34.5, 12, 4, 4}, /* lips */
	{0, -52, 11, 5, 4},   /* chin */
};

#define RELIEF_COUNT ((int)(sizeof(RELIEF) / sizeof(RELIEF[0])))
_Static_assert(sizeof(RELIEF) / sizeof(RELIEF[0]) <= FACE_RELIEF_MAX, "room for the scales");

double face_lobe(double azimuth_deg, double elevation_deg, double sigma_azimuth_deg,
		 double sigma_elevation_deg)
{
	double a = azimuth_deg / sigma_azimuth_deg, e = elevation_deg / sigma_elevation_deg;

	return exp(-0.5 * (a * a + e * e));
}

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

struct face_shape face_shape_make(struct rng *rng)
{
	double size = 1.0 + spread(rng, 0.02);
	struct face_shape shape = {.axes_m = {75 * MM * size * (1.0 + spread(rng, 0.02)),
					      110 * MM * size * (1.0 + spread(rng, 0.02)),
					      95 * MM * size * (1.0 + spread(rng, 0.02))}};

	for (int i = 0; i < RELIEF_COUNT; i++)
		shape.relief_scale[i] = size * (1.0 + spread(rng, 0.08));
	return shape;
}

static double radius_m(const struct face_shape *shape, struct vec3 direction, double azimuth,
		       double elevation)
{
	struct vec3 d = {direction.x / shape->axes_m.x, direction.y / shape->axes_m.y,
			 direction.z / shape->axes_m.z};
	double radius = 1.0 / vec3_norm(d);

	for (int i = 0; i < RELIEF_COUNT; i++) {
		double up = elevation - RELIEF[i].elevation_deg;
		double wide = RELIEF[i].sigma_azimuth_deg, high = RELIEF[i].sigma_elevation_deg;
		double sum = face_lobe(azimuth - RELIEF[i].azimuth_deg, up, wide, high);

		if (RELIEF[i].azimuth_deg > 0)
			sum += face_lobe(azimuth + RELIEF[i].azimuth_deg, up, wide, high);
		radius += shape->relief_scale[i] * RELIEF[i].height_mm * MM * sum;
	}
	return radius;
}

struct vec3 face_surface(const struct face_shape *shape, double azimuth_deg, double elevation_deg)
{
	double a = azimuth_deg * RAD, e = elevation_deg * RAD;
	struct vec3 direction = {sin(a) * cos(e), sin(e), cos(a) * cos(e)};

	return vec3_scale(direction, radius_m(shape, direction, azimuth_deg, elevation_deg));
}

struct vec3 face_surface_normal(const struct face_shape *shape, double azimuth_deg,
				double elevation_deg)
{
	double step_deg = 0.05;
	struct vec3 across = vec3_sub(face_surface(shape, azimuth_deg + step_deg, elevation_deg),
				      face_surface(shape, azimuth_deg - step_deg, elevation_deg));
	struct vec3 up = vec3_sub(face_surface(shape, azimuth_deg, elevation_deg + step_deg),
				  face_surface(shape, azimuth_deg, elevation_deg - step_deg));

	return vec3_unit(vec3_cross(across, up));
}
