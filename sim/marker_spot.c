/*
 * A flat disc, projected by its middle and two of its radii.
 */
#include "sim/marker_spot.h"

#define NOMINAL_RADIUS_M 0.75e-3

double marker_brightness(const struct sim_camera *camera, double peak_grey, double blur_sigma_px)
{
	double radius_px = NOMINAL_RADIUS_M * camera->intrinsics[0] / camera->range_m;

	return peak_grey / spot_peak_fraction(radius_px, blur_sigma_px);
}

/* Two unit vectors in the disc's plane. */
static void disc_axes(struct vec3 normal, struct vec3 axes[2])
{
	struct vec3 helper = fabs(normal.x) < 0.6 ? (struct vec3){1, 0, 0} : (struct vec3){0, 1, 0};

	axes[0] = vec3_unit(vec3_cross(normal, helper));
	axes[1] = vec3_cross(normal, axes[0]);
}

/* A retroreflector dims towards grazing angles, beyond what its narrower outline takes. */
static double angle_gain(double facing)
{
	double u = fmin(fmax((facing - 0.2) / 0.44, 0.0), 1.0);

	return 0.6 + 0.4 * u * u * (3.0 - 2.0 * u);
}

struct spot marker_spot(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
			uint32_t m, const double pixel[2], double facing, double brightness)
{
	const struct sim_camera *camera = &scene->cameras[c];
	struct vec3 p = truth->markers[m].p_stage_m, axes[2];
	double radius_m = 0.5 * scene->layout.markers[m].diameter_m;
	double nearness = camera->range_m / vec3_distance(camera->centre_stage_m, p);
	struct spot spot = {.centre_px = {pixel[0], pixel[1]},
			    .brightness = brightness * scene->markers[m].reflectivity *
					  angle_gain(facing) * nearness * nearness};

	disc_axes(truth->markers[m].normal_stage, axes);
	for (int k = 0; k < 2; k++) {
		double rim[2] = {pixel[0], pixel[1]};

		sim_camera_project(camera, vec3_add(p, vec3_scale(axes[k], radius_m)), rim);
		spot.axes_px[0][k] = rim[0] - pixel[0];
		spot.axes_px[1][k] = rim[1] - pixel[1];
	}
	return spot;
}
