/*
 * Lenses: OPENCV8 with every term in use, or a spline whose control points follow no formula that
 * OPENCV8 knows. mrcal projects through both.
 */
#include "sim/cameras.h"

#include <errno.h>
#include <mrcal/mrcal.h>
#include <stdio.h>
#include <string.h>

#define OPENCV8_COUNT 12
#define SPLINE_FOV_DEG 64 /* wider than any camera sees, so that no table meets the edge */
#define WAVES 4

static mrcal_lensmodel_t lens_model(const struct sim_camera *camera)
{
	mrcal_lensmodel_t opencv8 = {.type = MRCAL_LENSMODEL_OPENCV8};
	mrcal_lensmodel_t splined = {.type = MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC};

	splined.LENSMODEL_SPLINED_STEREOGRAPHIC__config.order = 3;
	splined.LENSMODEL_SPLINED_STEREOGRAPHIC__config.Nx = SIM_SPLINE_SIDE;
	splined.LENSMODEL_SPLINED_STEREOGRAPHIC__config.Ny = SIM_SPLINE_SIDE;
	splined.LENSMODEL_SPLINED_STEREOGRAPHIC__config.fov_x_deg = SPLINE_FOV_DEG;
	return camera->lens == SIM_LENS_SPLINED ? splined : opencv8;
}

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

static void set_distortion(double values[OPENCV8_COUNT - 4], struct rng *rng)
{
	values[0] = -0.12 + spread(rng, 0.03); /* k1 k2 p1 p2 k3 k4 k5 k6 */
	values[1] = 0.08 + spread(rng, 0.03);
	values[2] = spread(rng, 5e-4);
	values[3] = spread(rng, 5e-4);
	values[4] = spread(rng, 0.02);
	values[5] = spread(rng, 0.02);
	values[6] = spread(rng, 0.01);
	values[7] = spread(rng, 0.01);
}

/* Barrel distortion and a few waves of a pixel or two, in units of the stereographic plane, where
 * 1 is a focal length. */
static void set_spline(double *values, struct rng *rng)
{
	double half = 2 * tan(0.25 * SPLINE_FOV_DEG * M_PI / 180.0);
	double barrel = -0.10 + spread(rng, 0.03);
	double waves[WAVES][5];

	for (int w = 0; w < WAVES; w++) {
		waves[w][0] = spread(rng, 12); /* radians per unit */
		waves[w][1] = spread(rng, 12);
		waves[w][2] = spread(rng, M_PI);
		waves[w][3] = spread(rng, 6e-4);
		waves[w][4] = spread(rng, 6e-4);
	}
	for (int i = 0; i < SIM_SPLINE_SIDE * SIM_SPLINE_SIDE; i++) {
		double x = half * (2.0 * (i % SIM_SPLINE_SIDE) / (SIM_SPLINE_SIDE - 1) - 1);
		double y = half * (2.0 * (i / SIM_SPLINE_SIDE) / (SIM_SPLINE_SIDE - 1) - 1);
		double shift = barrel * (x * x + y * y);

		values[2 * i] = shift * x;
		values[2 * i + 1] = shift * y;
		for (int w = 0; w < WAVES; w++) {
			double height = sin(waves[w][0] * x + waves[w][1] * y + waves[w][2]);

			values[2 * i] += waves[w][3] * height;
			values[2 * i + 1] += waves[w][4] * height;
		}
	}
}

void sim_camera_set_lens(struct sim_camera *camera, int lens, double nominal_focal_px,
			 struct rng *rng)
{
	double focal_px = nominal_focal_px * (1 + spread(rng, 0.05));

	camera->lens = lens;
	camera->focal_px = focal_px;
	camera->intrinsics[0] = focal_px;
	camera->intrinsics[1] = focal_px * (1.0 + spread(rng, 0.001));
	camera->intrinsics[2] = 0.5 * (camera->width_px - 1) + spread(rng, 12);
	camera->intrinsics[3] = 0.5 * (camera->height_px - 1) + spread(rng, 12);
	if (lens == SIM_LENS_SPLINED)
		set_spline(camera->intrinsics + 4, rng);
	else
		set_distortion(camera->intrinsics + 4, rng);
}

bool sim_camera_project(const struct sim_camera *camera, struct vec3 p_stage_m, double pixel[2])
{
	mrcal_lensmodel_t model = lens_model(camera);
	struct vec3 p_cam = pose_apply(&camera->rt_cam_stage, p_stage_m);
	mrcal_point3_t p = {.x = p_cam.x, .y = p_cam.y, .z = p_cam.z};
	mrcal_point2_t q;

	if (p_cam.z <= 0 || !mrcal_project(&q, NULL, NULL, &p, 1, &model, camera->intrinsics))
		return false;
	pixel[0] = q.x;
	pixel[1] = q.y;
	return true;
}

double sim_camera_defocus_px(const struct sim_camera *camera, double range_m)
{
	return camera->focal_px * camera->aperture_m * fabs(1 / range_m - 1 / camera->range_m);
}

static void print_list(FILE *file, const char *key, const double *values, int count)
{
	fprintf(file, "    '%s': [", key);
	for (int i = 0; i < count; i++)
		fprintf(file, " %.17g,", values[i]);
	fprintf(file, " ],\n");
}

int sim_camera_write(const struct sim_camera *camera, const char *path, struct diag *diag)
{
	struct vec3 r = pose_to_rotation_vector(&camera->rt_cam_stage);
	struct vec3 t = camera->rt_cam_stage.t;
	double rt_cam_stage[6] = {r.x, r.y, r.z, t.x, t.y, t.z};
	mrcal_lensmodel_t model = lens_model(camera);
	FILE *file = fopen(path, "w");
	char name[128];
	int err = 0;

	if (!file)
		goto fail;
	mrcal_lensmodel_name(name, sizeof(name), &model);
	fprintf(file, "{\n    'lensmodel': '%s',\n", name);
	print_list(file, "intrinsics", camera->intrinsics, mrcal_lensmodel_num_params(&model));
	print_list(file, "extrinsics", rt_cam_stage, 6); /* mrcal: rt_cam_ref, ref = the stage */
	fprintf(file, "    'imagersize': [ %d, %d ],\n}\n", camera->width_px, camera->height_px);
	err = ferror(file) ? EIO : 0;
	if (fclose(file) == 0 && !err)
		return 0;
fail:
	err = errno ? errno : EIO;
	diag_add(diag, "%s: cannot write: %s", path, strerror(err));
	return -err;
}
