/*
 * Cameras on an arc in front of the actor, who looks along +y from the stage's origin.
 */
#include "sim/cameras.h"

#include <errno.h>
#include <mrcal/mrcal.h>
#include <stdio.h>
#include <string.h>

#include "base/rng.h"

#define RAD (M_PI / 180.0)

static const struct vec3 AIM_M = {0, 0, 1.2};

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

/* Looks from `centre` at `aim`; camera axes: x right, y down, z forward; then rolled about z. */
static struct pose look_at(struct vec3 centre, struct vec3 aim, double roll_rad)
{
	struct vec3 forward = vec3_unit(vec3_sub(aim, centre));
	struct vec3 right = vec3_unit(vec3_cross(forward, (struct vec3){0, 0, 1}));
	struct vec3 down = vec3_cross(forward, right);
	struct pose upright = {.r = {{right.x, right.y, right.z},
				     {down.x, down.y, down.z},
				     {forward.x, forward.y, forward.z}}};
	struct pose roll = pose_from_rotation_vector((struct vec3){0, 0, roll_rad});
	struct pose rt_cam_stage = pose_compose(&roll, &upright);

	rt_cam_stage.t = vec3_scale(pose_rotate(&rt_cam_stage, centre), -1.0);
	return rt_cam_stage;
}

static void set_lens(struct sim_camera *camera, double nominal_focal_px, struct rng *rng)
{
	double focal_px = nominal_focal_px * (1 + spread(rng, 0.05));
	double values[SIM_INTRINSICS] = {
		focal_px,
		focal_px * (1.0 + spread(rng, 0.001)),
		0.5 * (camera->width_px - 1) + spread(rng, 12),
		0.5 * (camera->height_px - 1) + spread(rng, 12),
		-0.12 + spread(rng, 0.03), /* k1 k2 p1 p2 k3 k4 k5 k6 */
		0.08 + spread(rng, 0.03),
		spread(rng, 5e-4),
		spread(rng, 5e-4),
		spread(rng, 0.02),
		spread(rng, 0.02),
		spread(rng, 0.01),
		spread(rng, 0.01),
	};

	memcpy(camera->intrinsics, values, sizeof(values));
}

static void stand_camera(struct sim_camera *camera, double azimuth, double away_m, double rise_m)
{
	camera->centre_stage_m =
		(struct vec3){-away_m * sin(azimuth), away_m * cos(azimuth), AIM_M.z + rise_m};
	camera->range_m = vec3_distance(camera->centre_stage_m, AIM_M);
}

void sim_cameras_init(struct sim_camera *cameras, uint32_t count, uint64_t seed)
{
	double half_arc_deg = count <= 4 ? 40 : 55;
	struct rng rng;

	rng_init(&rng, seed, 3);
	for (uint32_t c = 0; c < count; c++) {
		struct sim_camera *camera = &cameras[c];
		double azimuth =
			RAD * (half_arc_deg * (2.0 * c / (count - 1) - 1.0) + spread(&rng, 2));
		double rise_m = (c % 2 ? 0.20 : -0.25) + spread(&rng, 0.05);
		double away_m = 1.30 + spread(&rng, 0.12);
		struct vec3 aim = {spread(&rng, 0.01), spread(&rng, 0.01),
				   AIM_M.z + spread(&rng, 0.01)};

		memset(camera, 0, sizeof(*camera));
		snprintf(camera->name, sizeof(camera->name), "ir%u", c);
		camera->width_px = 1280;
		camera->height_px = 1024;
		stand_camera(camera, azimuth, away_m, rise_m);
		camera->rt_cam_stage = look_at(camera->centre_stage_m, aim, spread(&rng, 4 * RAD));
		set_lens(camera, 1600, &rng);
	}
}

void sim_hd_cameras_init(struct sim_camera *cameras, uint32_t count, uint64_t seed)
{
	static const double azimuth_deg[SIM_HD_MAX] = {0, -32, 32};
	struct rng rng;

	rng_init(&rng, seed, 4);
	for (uint32_t c = 0; c < count; c++) {
		struct sim_camera *camera = &cameras[c];
		double azimuth = RAD * (azimuth_deg[c] + spread(&rng, 2));

		memset(camera, 0, sizeof(*camera));
		snprintf(camera->name, sizeof(camera->name), "hd%u", c);
		camera->width_px = 1920;
		camera->height_px = 1080;
		stand_camera(camera, azimuth, 1.35 + spread(&rng, 0.05), spread(&rng, 0.03));
		camera->rt_cam_stage =
			look_at(camera->centre_stage_m, AIM_M, spread(&rng, 1 * RAD));
		set_lens(camera, 2300, &rng);
	}
}

bool sim_camera_project(const struct sim_camera *camera, struct vec3 p_stage_m, double pixel[2])
{
	static const mrcal_lensmodel_t OPENCV8 = {.type = MRCAL_LENSMODEL_OPENCV8};
	struct vec3 p_cam = pose_apply(&camera->rt_cam_stage, p_stage_m);
	mrcal_point3_t p = {.x = p_cam.x, .y = p_cam.y, .z = p_cam.z};
	mrcal_point2_t q;

	if (p_cam.z <= 0 || !mrcal_project(&q, NULL, NULL, &p, 1, &OPENCV8, camera->intrinsics))
		return false;
	pixel[0] = q.x;
	pixel[1] = q.y;
	return true;
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
	FILE *file = fopen(path, "w");
	int err = 0;

	if (!file)
		goto fail;
	fprintf(file, "{\n    'lensmodel': 'LENSMODEL_OPENCV8',\n");
	print_list(file, "intrinsics", camera->intrinsics, SIM_INTRINSICS);
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
