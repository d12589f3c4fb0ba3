/*
 * Outlines of discs and hemispheres: a middle and two radii, projected.
 */
#include "sim/render/marker_spot.h"

/* The face markers of the scene, which its cameras are set for. */
static double nominal_radius_m(const struct sim_scene *scene)
{
	double least_m = INFINITY;

	for (uint32_t m = 0; m < scene->layout.marker_count; m++)
		least_m = fmin(least_m, scene->layout.markers[m].diameter_m);
	return 0.5 * (isfinite(least_m) ? least_m : 1.5e-3);
}

double marker_brightness(const struct sim_scene *scene, uint32_t c, double peak_grey,
			 double blur_sigma_px)
{
	const struct sim_camera *camera = &scene->cameras[c];
	double radius_px = nominal_radius_m(scene) * camera->focal_px / camera->range_m;

	return peak_grey / spot_peak_fraction(radius_px, blur_sigma_px);
}

/* The strobe's light gets weaker with range. */
static double range_gain(const struct sim_camera *camera, struct vec3 p_stage_m)
{
	double nearness = camera->range_m / vec3_distance(camera->centre_stage_m, p_stage_m);

	return nearness * nearness;
}

/* Two unit vectors across `normal`. */
static void disc_axes(struct vec3 normal, struct vec3 axes[2])
{
	struct vec3 helper = fabs(normal.x) < 0.6 ? (struct vec3){1, 0, 0} : (struct vec3){0, 1, 0};

	axes[0] = vec3_unit(vec3_cross(normal, helper));
	axes[1] = vec3_cross(normal, axes[0]);
}

/* A hemisphere's outline is that of its sphere on the side to which it leans: axes across the line
 * of sight, the second one that way. */
static void dome_axes(struct vec3 normal, struct vec3 to_camera, struct vec3 axes[2])
{
	struct vec3 across = vec3_cross(normal, to_camera);

	if (vec3_norm(across) < 1e-6)
		disc_axes(to_camera, axes);
	else
		axes[0] = vec3_unit(across);
	axes[1] = vec3_cross(to_camera, axes[0]);
}

/* A retroreflector dims towards grazing angles, beyond what its narrower outline takes. */
static double angle_gain(double facing)
{
	double u = fmin(fmax((facing - 0.2) / 0.44, 0.0), 1.0);

	return 0.6 + 0.4 * u * u * (3.0 - 2.0 * u);
}

static void project_axes(const struct sim_camera *camera, struct vec3 centre, double radius_m,
			 const struct vec3 axes[2], struct spot *spot)
{
	for (int k = 0; k < 2; k++) {
		double rim[2] = {spot->centre_px[0], spot->centre_px[1]};

		sim_camera_project(camera, vec3_add(centre, vec3_scale(axes[k], radius_m)), rim);
		spot->axes_px[0][k] = rim[0] - spot->centre_px[0];
		spot->axes_px[1][k] = rim[1] - spot->centre_px[1];
	}
	spot->defocus_px =
		sim_camera_defocus_px(camera, vec3_distance(camera->centre_stage_m, centre));
}

struct spot marker_spot(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
			uint32_t m, const double pixel[2], double facing, double brightness)
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	const struct sim_truth_marker *marker = &truth->markers[m];
	bool dome = scene->markers[m].hemisphere;
	struct vec3 axes[2],
		to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, marker->p_stage_m));
	struct spot spot = {.centre_px = {pixel[0], pixel[1]},
			    .squeeze = dome ? 1 - fmax(facing, 0) : 0,
			    .brightness = brightness * scene->markers[m].reflectivity *
					  (dome ? 1 : angle_gain(facing)) *
					  range_gain(camera, marker->p_stage_m)};

	if (dome)
		dome_axes(marker->normal_stage, to_camera, axes);
	else
		disc_axes(marker->normal_stage, axes);
	project_axes(camera, marker->p_stage_m, 0.5 * scene->layout.markers[m].diameter_m, axes,
		     &spot);
	return spot;
}

bool disc_spot(const struct sim_camera *camera, struct vec3 centre_stage_m, struct vec3 normal,
	       double radius_m, double brightness, struct spot *out)
{
	struct spot spot = {.brightness = brightness};
	struct vec3 axes[2];

	if (!sim_camera_project(camera, centre_stage_m, spot.centre_px))
		return false;
	disc_axes(normal, axes);
	project_axes(camera, centre_stage_m, radius_m, axes, &spot);
	*out = spot;
	return true;
}

bool ghost_spot(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
		struct vec3 p_stage_m, double value, double brightness, struct spot *out)
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	struct vec3 to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, p_stage_m));

	return disc_spot(camera, p_stage_m, to_camera, nominal_radius_m(scene),
			 brightness * value * range_gain(camera, p_stage_m), out);
}
