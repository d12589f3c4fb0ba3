/*
 * A view's tables agree with mrcal for every lens model, in both directions and in the gradient.
 */
#include "track/view.h"

#include <errno.h>
#include <mrcal/mrcal.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/rng.h"

#define WIDTH_PX 1280
#define HEIGHT_PX 1024

struct lens {
	mrcal_lensmodel_t model;
	double intrinsics[2000];
};

static bool project(const void *user, struct vec3 p, double pixel[2])
{
	const struct lens *lens = user;
	mrcal_point3_t point = {.x = p.x, .y = p.y, .z = p.z};

	return mrcal_project((mrcal_point2_t *)pixel, NULL, NULL, &point, 1, &lens->model,
			     lens->intrinsics);
}

static bool unproject(const void *user, const double pixel[2], struct vec3 *v)
{
	const struct lens *lens = user;

	return mrcal_unproject((mrcal_point3_t *)v, (const mrcal_point2_t *)pixel, 1, &lens->model,
			       lens->intrinsics);
}

struct example {
	const char *lens;
	double intrinsics[16];
};

static const struct example examples[] = {
	{"LENSMODEL_PINHOLE", {1500, 1501, 641, 510}},
	{"LENSMODEL_PINHOLE", {400, 401, 641, 510}}, /* 116 degrees */
	{"LENSMODEL_STEREOGRAPHIC", {400, 401, 641, 510}},
	{"LENSMODEL_OPENCV4", {1500, 1501, 641, 510, -0.1, 0.05, 1e-3, -5e-4}},
	{"LENSMODEL_OPENCV5", {900, 901, 641, 510, -0.2, 0.08, 1e-3, -5e-4, -0.01}},
	{"LENSMODEL_OPENCV8",
	 {700, 701, 650, 500, 0.5, -0.05, 1e-3, -5e-4, 0.003, 0.75, -0.02, 0.005}},
	{"LENSMODEL_OPENCV12",
	 {900, 901, 641, 510, -0.1, 0.05, 1e-3, -5e-4, 0.01, 0.1, -0.02, 0.005, 1e-4, 2e-4, -1e-4,
	  1e-4}},
	{"LENSMODEL_CAHVOR", {1500, 1501, 641, 510, 0.01, -0.02, 1e-3, -0.1, 0.05}},
	{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=24_fov_x_deg=60",
	 {1500, 1501, 641, 510}},
	{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=2_Nx=30_Ny=24_fov_x_deg=60",
	 {1500, 1501, 641, 510}},
	/* folds back into the image from 46 degrees on */
	{"LENSMODEL_OPENCV4", {1500, 1501, 641, 510, -0.3, 0, 0, 0}},
};

#define EXAMPLE_COUNT ((int)(sizeof(examples) / sizeof(examples[0])))

static void lens_from_example(struct lens *lens, const struct example *example)
{
	memset(lens, 0, sizeof(*lens));
	assert_true(mrcal_lensmodel_from_name(&lens->model, example->lens));
	memcpy(lens->intrinsics, example->intrinsics, sizeof(example->intrinsics));
	/* the spline's control points: smooth barrel distortion */
	int count = mrcal_lensmodel_num_params(&lens->model);
	for (int i = 4; lens->model.type == MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC && i < count;
	     i++) {
		double x = ((i - 4) / 2 % 30) / 14.5 - 1, y = ((i - 4) / 60) / 11.5 - 1;

		lens->intrinsics[i] = -0.02 * (x * x + y * y) * (i % 2 ? y : x);
	}
}

/* made once for all tests */
static struct lens lenses[EXAMPLE_COUNT];
static struct view views[EXAMPLE_COUNT];

static struct pose some_pose(void)
{
	struct pose pose = pose_from_rotation_vector((struct vec3){0.4, -1.1, 0.7});

	pose.t = (struct vec3){0.3, -0.2, 2.0};
	return pose;
}

static int make_views(void **state)
{
	(void)state;
	for (int i = 0; i < EXAMPLE_COUNT; i++) {
		struct lens_model model = {project, unproject, &lenses[i]};
		int64_t start_ns = clock_now_ns();
		double bad[2];

		lens_from_example(&lenses[i], &examples[i]);
		if (view_init(&views[i], WIDTH_PX, HEIGHT_PX, some_pose(), &model, bad))
			return -1;
		print_message("# %.40s: built in %.0f ms\n", examples[i].lens,
			      (double)(clock_now_ns() - start_ns) / 1e6);
	}
	return 0;
}

static int free_views(void **state)
{
	(void)state;
	for (int i = 0; i < EXAMPLE_COUNT; i++)
		view_finish(&views[i]);
	return 0;
}

/* A random pixel, every 8th on the border. */
static void pick_pixel(struct rng *rng, double q[2])
{
	q[0] = rng_uniform(rng) * (WIDTH_PX - 1);
	q[1] = rng_uniform(rng) * (HEIGHT_PX - 1);
	if (rng_u32(rng) % 8 == 0)
		q[rng_u32(rng) % 2] = 0;
	else if (rng_u32(rng) % 8 == 0)
		q[0] = WIDTH_PX - 1;
}

/* Worst distance in pixels between the table and mrcal, in both directions. */
static void measure(const struct view *view, const struct lens *lens, double *ray_px,
		    double *project_px)
{
	struct rng rng;

	rng_init(&rng, 1, 1);
	*ray_px = *project_px = 0;
	for (int i = 0; i < 20000; i++) {
		double q[2], model_q[2], table_q[2];

		pick_pixel(&rng, q);
		struct vec3 ray = view_ray(view, q);
		struct vec3 p = vec3_add(view->centre_stage_m, vec3_scale(ray, 1.7));
		assert_true(fabs(vec3_norm(ray) - 1) < 1e-12);
		assert_true(project(lens, pose_apply(&view->rt_cam_stage, p), model_q));
		*ray_px = fmax(*ray_px, hypot(model_q[0] - q[0], model_q[1] - q[1]));
		assert_true(view_project(view, p, table_q, NULL));
		*project_px =
			fmax(*project_px, hypot(model_q[0] - table_q[0], model_q[1] - table_q[1]));
	}
}

static void tables_agree_with_mrcal_within_a_few_ten_thousandths_of_a_pixel(void **state)
{
	(void)state;
	for (int i = 0; i < EXAMPLE_COUNT; i++) {
		double ray_px, project_px;

		measure(&views[i], &lenses[i], &ray_px, &project_px);
		print_message("# %.40s: ray %.1e px, project %.1e px\n", examples[i].lens, ray_px,
			      project_px);
		assert_true(ray_px < 3e-4 && project_px < 3e-4);
	}
}

/* Largest difference between the table's gradient and numeric differences, relative to the
 * gradient's size. */
static double gradient_error(const struct view *view, struct vec3 p)
{
	double q[2], low[2], high[2], dq_dp[2][3], worst = 0, h = 1e-5;

	assert_true(view_project(view, p, q, dq_dp));
	for (int k = 0; k < 3; k++) {
		struct vec3 step = {k == 0 ? h : 0, k == 1 ? h : 0, k == 2 ? h : 0};

		assert_true(view_project(view, vec3_sub(p, step), low, NULL));
		assert_true(view_project(view, vec3_add(p, step), high, NULL));
		for (int i = 0; i < 2; i++)
			worst = fmax(worst, fabs((high[i] - low[i]) / (2 * h) - dq_dp[i][k]));
	}
	return worst / 1000;
}

static void gradients_agree_with_numeric_differences(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 2, 1);
	for (int i = 0; i < EXAMPLE_COUNT; i++) {
		double q[2], worst = 0;

		for (int n = 0; n < 500; n++) {
			pick_pixel(&rng, q);
			struct vec3 ray = vec3_scale(view_ray(&views[i], q), 1 + rng_uniform(&rng));
			worst = fmax(worst, gradient_error(&views[i],
							   vec3_add(views[i].centre_stage_m, ray)));
		}
		assert_true(worst < 1e-5);
	}
}

static struct vec3 ahead_of(const struct view *view, double x, double y, double z)
{
	struct pose rt_stage_cam = pose_inverse(&view->rt_cam_stage);

	return pose_apply(&rt_stage_cam, (struct vec3){x, y, z});
}

/* Lenses whose formula folds back into the image beyond its border are among the examples. */
static void points_outside_the_image_are_never_in_it(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 1);
	for (int i = 0; i < EXAMPLE_COUNT; i++) {
		double q[2];

		for (int n = 0; n < 5000; n++) {
			struct vec3 p = {rng_normal(&rng), rng_normal(&rng), rng_normal(&rng)};
			struct vec3 p_stage_m = ahead_of(&views[i], p.x, p.y, p.z);
			if (!view_project(&views[i], p_stage_m, q, NULL))
				continue;
			assert_true(q[0] >= -8 && q[0] <= WIDTH_PX + 7);
			assert_true(q[1] >= -8 && q[1] <= HEIGHT_PX + 7);
			/* the ray of that pixel leads back to the point */
			struct vec3 to = vec3_unit(vec3_sub(p_stage_m, views[i].centre_stage_m));
			assert_true(vec3_distance(view_ray(&views[i], q), to) < 1e-5);
		}
	}
}

static void impossible_points_are_not_seen(void **state)
{
	double q[2] = {-1, -2}, dq_dp[2][3];

	(void)state;
	assert_false(view_project(&views[3], views[3].centre_stage_m, q, dq_dp));
	assert_false(view_project(&views[3], ahead_of(&views[3], 0, 0, -1), q, dq_dp));
	assert_false(view_project(&views[3], ahead_of(&views[3], 0.01, 0.02, -1), q, dq_dp));
	assert_false(view_project(&views[3], (struct vec3){NAN, 0, 0}, q, dq_dp));
	assert_false(view_project(&views[3], (struct vec3){INFINITY, 0, 0}, q, dq_dp));
	assert_true(q[0] == -1 && q[1] == -2); /* untouched */
	assert_true(view_project(&views[3], ahead_of(&views[3], 0, 0, 1e-3), q, dq_dp));
}

static void a_point_just_beyond_the_border_is_still_projected(void **state)
{
	double q[2];

	(void)state;
	for (int i = 0; i < EXAMPLE_COUNT; i++) {
		double beyond = view_margin_px(&views[i]) * 0.9;
		struct vec3 ray = view_ray(&views[i], (double[2]){-beyond, HEIGHT_PX / 2.0});
		assert_true(
			view_project(&views[i], vec3_add(views[i].centre_stage_m, ray), q, NULL));
		assert_true(fabs(q[0] + beyond) < 0.02 && fabs(q[1] - HEIGHT_PX / 2.0) < 0.02);
		ray = view_ray(&views[i], (double[2]){WIDTH_PX - 1 + beyond, 0});
		assert_true(
			view_project(&views[i], vec3_add(views[i].centre_stage_m, ray), q, NULL));
		assert_true(fabs(q[0] - (WIDTH_PX - 1 + beyond)) < 0.1 && fabs(q[1]) < 0.1);
	}
}

/* A replay stands on this. */
static void the_same_model_gives_the_same_tables_to_the_bit(void **state)
{
	struct lens_model model = {project, unproject, &lenses[4]};
	struct view again;
	double bad[2];

	(void)state;
	assert_int_equal(view_init(&again, WIDTH_PX, HEIGHT_PX, some_pose(), &model, bad), 0);
	const struct lens_grid *a = &views[4].plane_to_pixel, *b = &again.plane_to_pixel;
	size_t nodes = (size_t)a->x_count * (size_t)a->y_count;
	assert_int_equal((size_t)b->x_count * (size_t)b->y_count, nodes);
	assert_memory_equal(a->node, b->node, nodes * sizeof(*a->node));
	a = &views[4].pixel_to_plane;
	b = &again.pixel_to_plane;
	nodes = (size_t)a->x_count * (size_t)a->y_count;
	assert_memory_equal(a->node, b->node, nodes * sizeof(*a->node));
	view_finish(&again);
}

/* Barrel distortion so strong that the corners lie beyond the fold. */
static void a_lens_that_folds_inside_the_image_is_refused(void **state)
{
	const struct example folding = {"LENSMODEL_OPENCV4", {900, 900, 640, 512, -0.6, 0, 0, 0}};
	struct lens lens;
	struct lens_model model = {project, unproject, &lens};
	struct view view = {0};
	double bad[2] = {-1, -1};

	(void)state;
	lens_from_example(&lens, &folding);
	assert_int_equal(view_init(&view, WIDTH_PX, HEIGHT_PX, POSE_IDENTITY, &model, bad), -EDOM);
	assert_true(bad[0] >= 0 && bad[1] >= 0);
	assert_null(view.pixel_to_plane.node);
	assert_int_equal(view_init(&view, 31, 1024, POSE_IDENTITY, &model, bad), -EINVAL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tables_agree_with_mrcal_within_a_few_ten_thousandths_of_a_pixel),
		cmocka_unit_test(gradients_agree_with_numeric_differences),
		cmocka_unit_test(points_outside_the_image_are_never_in_it),
		cmocka_unit_test(impossible_points_are_not_seen),
		cmocka_unit_test(a_point_just_beyond_the_border_is_still_projected),
		cmocka_unit_test(the_same_model_gives_the_same_tables_to_the_bit),
		cmocka_unit_test(a_lens_that_folds_inside_the_image_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_views, free_views);
}
