/*
 * Cameras on a sphere over 200 degrees of azimuth, no two nearly in line, rolled at will.
 */
#include "tests/bench/points_rig.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define APART_COSINE 0.97 /* of the directions of two cameras, at the most: 14 degrees */

static double between(struct rng *rng, double low, double high)
{
	return low + (high - low) * rng_uniform(rng);
}

struct vec3 random_in_ball(struct rng *rng, double radius_m)
{
	for (;;) {
		double x = between(rng, -1, 1), y = between(rng, -1, 1), z = between(rng, -1, 1);
		struct vec3 p = {x, y, z};

		if (vec3_norm(p) <= 1)
			return vec3_scale(p, radius_m);
	}
}

static void project(const struct rig_camera *camera, struct vec3 p, double pixel[2])
{
	double x = p.x / p.z, y = p.y / p.z, scale = 1 + camera->bend * (x * x + y * y);

	pixel[0] = RIG_WIDTH_PX / 2 - 0.5 + camera->focal_px * scale * x;
	pixel[1] = RIG_HEIGHT_PX / 2 - 0.5 + camera->focal_px * scale * y;
}

static bool model_project(const void *user, struct vec3 p, double pixel[2])
{
	if (p.z <= 0)
		return false;
	project(user, p, pixel);
	return true;
}

static bool model_unproject(const void *user, const double pixel[2], struct vec3 *v)
{
	const struct rig_camera *camera = user;
	double x = (pixel[0] - (RIG_WIDTH_PX / 2 - 0.5)) / camera->focal_px;
	double y = (pixel[1] - (RIG_HEIGHT_PX / 2 - 0.5)) / camera->focal_px;
	double bent = hypot(x, y), r = bent;

	for (int i = 0; i < 20; i++) /* Newton on r (1 + bend r^2) = bent */
		r -= (r * (1 + camera->bend * r * r) - bent) / (1 + 3 * camera->bend * r * r);
	double scale = bent > 0 ? r / bent : 1;
	*v = (struct vec3){x * scale, y * scale, 1};
	return true;
}

void rig_camera_project(const struct rig_camera *camera, struct vec3 p_stage_m, double pixel[2])
{
	project(camera, pose_apply(&camera->rt_cam_stage, p_stage_m), pixel);
}

void rig_camera_slopes(const struct rig_camera *camera, struct vec3 p, double slopes[2][3])
{
	static const double step_m = 1e-5;

	for (int k = 0; k < 3; k++) {
		struct vec3 step = {k == 0 ? step_m : 0, k == 1 ? step_m : 0, k == 2 ? step_m : 0};
		double low[2], high[2];

		rig_camera_project(camera, vec3_sub(p, step), low);
		rig_camera_project(camera, vec3_add(p, step), high);
		for (int i = 0; i < 2; i++)
			slopes[i][k] = (high[i] - low[i]) / (2 * step_m);
	}
}

/* From the camera's place, direction of sight and roll. */
static struct pose look(struct vec3 centre_m, struct vec3 at_m, double roll_rad)
{
	struct vec3 z = vec3_unit(vec3_sub(at_m, centre_m));
	struct vec3 x = vec3_unit(vec3_cross(z, (struct vec3){0, 1, 0}));
	struct vec3 y = vec3_cross(z, x);
	struct pose upright = {
		.r = {{x.x, x.y, x.z}, {y.x, y.y, y.z}, {z.x, z.y, z.z}},
	};
	struct pose roll = pose_from_rotation_vector((struct vec3){0, 0, roll_rad});
	struct pose out = pose_compose(&roll, &upright);

	out.t = vec3_scale(pose_rotate(&out, centre_m), -1);
	return out;
}

static struct vec3 random_direction(struct rng *rng)
{
	double azimuth = between(rng, -1.75, 1.75), rise = between(rng, -0.35, 0.9);

	return (struct vec3){sin(azimuth) * cos(rise), sin(rise), cos(azimuth) * cos(rise)};
}

/* In many tries apart from all others; a crowd stands nearer together. */
static struct vec3 free_direction(struct rng *rng, const struct vec3 *taken, uint32_t count)
{
	struct vec3 direction = random_direction(rng);

	for (int tries = 0; tries < 200; tries++) {
		bool apart = true;

		for (uint32_t c = 0; c < count; c++)
			apart &= vec3_dot(direction, taken[c]) < APART_COSINE;
		if (apart)
			break;
		direction = random_direction(rng);
	}
	return direction;
}

static void add_camera(struct random_rig *rig, struct rng *rng, struct vec3 direction,
		       double ball_m)
{
	struct rig_camera *camera = &rig->cameras[rig->count];
	double range_m = fmax(between(rng, 0.8, 2.5), between(rng, 2.5, 4) * ball_m);
	double fill = between(rng, 0.8, 1.1); /* of the picture's height by the ball */
	struct lens_model model = {model_project, model_unproject, camera};
	double bad[2];

	camera->rt_cam_stage = look(vec3_scale(direction, range_m),
				    random_in_ball(rng, 0.1 * ball_m), between(rng, -3, 3));
	camera->focal_px = fill * RIG_HEIGHT_PX / 2 * (range_m - ball_m) / (1.1 * ball_m);
	double corner = hypot(RIG_WIDTH_PX, RIG_HEIGHT_PX) / 2 / camera->focal_px;
	camera->bend = between(rng, -0.1, 0.1) / fmax(1, corner * corner);
	if (view_init(&rig->views[rig->count], RIG_WIDTH_PX, RIG_HEIGHT_PX, camera->rt_cam_stage,
		      &model, bad)) {
		fprintf(stderr, "bench: a random lens cannot be used\n");
		exit(1);
	}
	rig->count++;
}

void random_rig_init(struct random_rig *rig, struct rng *rng, uint32_t count, double ball_m)
{
	struct vec3 directions[CAMERA_MAX];

	memset(rig, 0, sizeof(*rig));
	while (rig->count < count) {
		directions[rig->count] = free_direction(rng, directions, rig->count);
		add_camera(rig, rng, directions[rig->count], ball_m);
	}
}

void random_rig_finish(struct random_rig *rig)
{
	for (uint32_t c = 0; c < rig->count; c++)
		view_finish(&rig->views[c]);
	memset(rig, 0, sizeof(*rig));
}
