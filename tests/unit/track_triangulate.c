/*
 * Triangulated points lie where their covariance says, and a view that does not belong is found.
 */
#include "track/match/triangulate.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/view_many.h"

#define VIEWS 6
#define ALL_VIEWS 10
#define FOCAL_PX 1500.0

static struct view views[ALL_VIEWS];

static bool project(const void *user, struct vec3 p, double pixel[2])
{
	(void)user;
	pixel[0] = 639.5 + FOCAL_PX * p.x / p.z;
	pixel[1] = 511.5 + FOCAL_PX * p.y / p.z;
	return p.z > 0;
}

static bool unproject(const void *user, const double pixel[2], struct vec3 *v)
{
	(void)user;
	*v = (struct vec3){(pixel[0] - 639.5) / FOCAL_PX, (pixel[1] - 511.5) / FOCAL_PX, 1};
	return true;
}

/* Cameras on an arc of 100 degrees, and four more behind its end, 1.6 m from the stage's origin,
 * looking at it. */
static int make_views(void **state)
{
	struct lens_model model = {project, unproject, NULL};
	double bad[2];

	(void)state;
	for (int i = 0; i < ALL_VIEWS; i++) {
		double angle = (i - 2.5) * 0.35;
		struct pose turn = pose_from_rotation_vector((struct vec3){0, angle, 0});

		turn.t = (struct vec3){0, 0, 1.6};
		if (view_init(&views[i], 1280, 1024, turn, &model, bad))
			return -1;
	}
	return 0;
}

static int free_views(void **state)
{
	(void)state;
	for (int i = 0; i < ALL_VIEWS; i++)
		view_finish(&views[i]);
	return 0;
}

static struct vec3 random_point(struct rng *rng)
{
	double x = rng_uniform(rng), y = rng_uniform(rng), z = rng_uniform(rng);

	return (struct vec3){0.2 * x - 0.1, 0.2 * y - 0.1, 0.2 * z - 0.1};
}

static void sight(struct rng *rng, struct vec3 p, double sigma_px, struct sighting *out, int count)
{
	for (int i = 0; i < count; i++) {
		out[i] = (struct sighting){.view = &views[i], .sigma_px = sigma_px * (1 + i % 3)};
		assert_true(view_project(&views[i], p, out[i].pixel, NULL));
		out[i].pixel[0] += out[i].sigma_px * rng_normal(rng);
		out[i].pixel[1] += out[i].sigma_px * rng_normal(rng);
	}
}

static void exact_pixels_give_the_exact_point(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;

	(void)state;
	rng_init(&rng, 5, 0);
	for (int trial = 0; trial < 200; trial++) {
		struct vec3 p = random_point(&rng);

		sight(&rng, p, 1e-9, sightings, 2 + trial % 5);
		assert_int_equal(triangulate(sightings, 2 + trial % 5, NULL, &fix), 0);
		assert_true(vec3_distance(fix.p_stage_m, p) < 2e-6); /* the lens tables' error */
		assert_int_equal(fix.used_count, 2 + trial % 5);
	}
}

/* Mean of e' C^-1 e over axes and trials, from the diagonal and off-diagonal terms. */
static double squared_sigmas(struct vec3 e, const double c[6])
{
	double det = c[0] * (c[3] * c[5] - c[4] * c[4]) - c[1] * (c[1] * c[5] - c[4] * c[2]) +
		     c[2] * (c[1] * c[4] - c[3] * c[2]);
	double x = (c[3] * c[5] - c[4] * c[4]) * e.x + (c[2] * c[4] - c[1] * c[5]) * e.y +
		   (c[1] * c[4] - c[2] * c[3]) * e.z;
	double y = (c[2] * c[4] - c[1] * c[5]) * e.x + (c[0] * c[5] - c[2] * c[2]) * e.y +
		   (c[1] * c[2] - c[0] * c[4]) * e.z;
	double z = (c[1] * c[4] - c[2] * c[3]) * e.x + (c[1] * c[2] - c[0] * c[4]) * e.y +
		   (c[0] * c[3] - c[1] * c[1]) * e.z;

	return (x * e.x + y * e.y + z * e.z) / det;
}

static void covariances_are_true_for_two_to_six_views(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;

	(void)state;
	rng_init(&rng, 6, 0);
	for (int count = 2; count <= VIEWS; count++) {
		double sum = 0;

		for (int trial = 0; trial < 3000; trial++) {
			struct vec3 p = random_point(&rng);

			sight(&rng, p, 0.05, sightings, count);
			assert_int_equal(triangulate(sightings, count, NULL, &fix), 0);
			sum += squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) / 3;
		}
		assert_true(sum / 3000 > 0.9 && sum / 3000 < 1.1);
	}
}

static void a_view_one_pixel_off_is_left_out(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int found = 0;

	(void)state;
	rng_init(&rng, 8, 0);
	for (int trial = 0; trial < 1000; trial++) {
		struct vec3 p = random_point(&rng);
		int bad = trial % 4;

		sight(&rng, p, 0.03, sightings, 4);
		sightings[bad].pixel[trial & 1] += 1;
		assert_int_equal(triangulate(sightings, 4, NULL, &fix), 0);
		found += fix.used_mask == (0xfu & ~(1u << bad));
	}
	assert_true(found > 900);
}

static void good_views_are_kept(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int dropped = 0;

	(void)state;
	rng_init(&rng, 9, 0);
	for (int trial = 0; trial < 6000; trial++) {
		int count = 3 + trial % 4;

		sight(&rng, random_point(&rng), 0.04, sightings, count);
		assert_int_equal(triangulate(sightings, count, NULL, &fix), 0);
		dropped += fix.used_count < count;
	}
	print_message("# %d of 6000\n", dropped);
	assert_true(dropped < 60);
}

/* Some of them beside the picture or behind the camera. */
static void project_together(view_project_many_fn *build)
{
	struct vec3 p[100];
	struct projection many[100], one;
	bool in_sight[100];
	struct rng rng;
	int seen = 0;

	rng_init(&rng, 14, 0);
	for (int i = 0; i < 100; i++)
		p[i] = vec3_scale(random_point(&rng), i % 3 ? 1 : 40);
	build(&views[0], p, 100, many, in_sight);
	for (int i = 0; i < 100; i++) {
		assert_int_equal(view_project(&views[0], p[i], one.pixel, one.slopes), in_sight[i]);
		seen += in_sight[i];
		if (in_sight[i])
			assert_memory_equal(&one, &many[i], sizeof(one));
	}
	assert_in_range(seen, 60, 95);
}

static void points_project_together_as_one_by_one(void **state)
{
	(void)state;
	project_together(view_project_many);
	project_together(view_project_many_any);
}

static void move_aside(double off_px, double turn_rad, struct sighting *sighting)
{
	sighting->pixel[0] += off_px * cos(turn_rad);
	sighting->pixel[1] += off_px * sin(turn_rad);
}

/* Exact but for noise of sigma_px, and one view `off_px` aside in a direction that turns. */
static int sight_with_liar(struct rng *rng, struct vec3 p, int count, double sigma_px,
			   double off_px, struct sighting *out)
{
	int bad = (int)(rng_u32(rng) % (uint32_t)count);
	double turn_rad = 6.28 * rng_uniform(rng);

	for (int i = 0; i < count; i++) {
		out[i] = (struct sighting){.view = &views[i], .sigma_px = sigma_px};
		assert_true(view_project(&views[i], p, out[i].pixel, NULL));
		out[i].pixel[0] += sigma_px * rng_normal(rng);
		out[i].pixel[1] += sigma_px * rng_normal(rng);
	}
	move_aside(off_px, turn_rad, &out[bad]);
	return bad;
}

static void a_view_far_off_pulls_nobody(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;

	(void)state;
	rng_init(&rng, 10, 0);
	for (int trial = 0; trial < 1000; trial++) {
		struct vec3 p = random_point(&rng);
		double off_px = 3 + 27 * rng_uniform(&rng);
		int bad = sight_with_liar(&rng, p, 5, 0.03, off_px, sightings);

		assert_int_equal(triangulate(sightings, 5, NULL, &fix), 0);
		assert_int_equal(fix.used_mask, 0x1fu & ~(1u << bad));
		assert_true(squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) < 30);
	}
}

static void covariances_are_true_where_it_is_not_plain_who_lies(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;

	(void)state;
	rng_init(&rng, 11, 0);
	for (int count = 3; count <= 5; count++) {
		double sum = 0;

		for (int trial = 0; trial < 3000; trial++) {
			struct vec3 p = random_point(&rng);

			sight_with_liar(&rng, p, count, 0.1, trial % 10 ? 0 : 1, sightings);
			assert_int_equal(triangulate(sightings, count, NULL, &fix), 0);
			sum += squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) / 3;
		}
		assert_true(sum / 3000 > 0.8 && sum / 3000 < 1.25);
	}
}

static void a_poor_view_is_used_and_the_covariance_says_so(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int used = 0, doubted = 0;
	double sum = 0;

	(void)state;
	rng_init(&rng, 14, 0);
	for (int trial = 0; trial < 3000; trial++) {
		struct vec3 p = random_point(&rng);

		sight_with_liar(&rng, p, 3, 0.05, 0.2, sightings);
		assert_int_equal(triangulate(sightings, 3, NULL, &fix), 0);
		if (fix.chi2_per_dof < 3)
			continue;
		doubted++;
		used += fix.used_count == 3;
		sum += squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) / 3;
	}
	print_message("# %d of %d use all, nees / 3 = %.2f\n", used, doubted, sum / doubted);
	assert_true(doubted > 300);
	assert_true(used > 0.9 * doubted);
	assert_true(sum / doubted > 0.6 && sum / doubted < 1.25);
}

static void a_merged_blob_is_the_first_to_be_suspected(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int left_out[2] = {0, 0};

	(void)state;
	rng_init(&rng, 12, 0);
	for (int trial = 0; trial < 2000; trial++) {
		int bad = sight_with_liar(&rng, random_point(&rng), 4, 0.08, 0.4, sightings);

		for (int merged = 0; merged < 2; merged++) {
			sightings[bad].flags = merged ? BLOB_MERGED : 0;
			assert_int_equal(triangulate(sightings, 4, NULL, &fix), 0);
			left_out[merged] += !(fix.used_mask >> bad & 1);
		}
	}
	assert_true(left_out[1] > left_out[0] + 200);
}

/* Half of its disc may be hidden still. Which of three views is off they hardly tell themselves. */
static void who_was_outvoted_is_suspected_again(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int plain[2] = {0, 0};

	(void)state;
	rng_init(&rng, 14, 0);
	for (int trial = 0; trial < 2000; trial++) {
		struct vec3 p = random_point(&rng);
		int bad = sight_with_liar(&rng, p, 3, 0.012, 0.3, sightings);

		for (int again = 0; again < 2; again++) {
			sightings[bad].was_outvoted = again;
			assert_int_equal(triangulate(sightings, 3, NULL, &fix), 0);
			plain[again] +=
				fix.used_mask == (7u & ~(1u << bad)) && fix.chi2_per_dof < 25;
		}
	}
	print_message("# plain: %d, where it was outvoted %d of 2000\n", plain[0], plain[1]);
	assert_true(2000 - plain[1] < 0.5 * (2000 - plain[0]));
}

static void sigmas_that_are_all_too_small_leave_no_view_out(void **state)
{
	struct rng rng;
	struct sighting sightings[VIEWS];
	struct fix fix;
	int used = 0;
	double sum = 0;

	(void)state;
	rng_init(&rng, 13, 0);
	for (int trial = 0; trial < 1000; trial++) {
		struct vec3 p = random_point(&rng);

		sight(&rng, p, 0.15, sightings, VIEWS);
		for (int i = 0; i < VIEWS; i++)
			sightings[i].sigma_px /= 10;
		assert_int_equal(triangulate(sightings, VIEWS, NULL, &fix), 0);
		used += fix.used_count;
		sum += squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) / 3;
	}
	assert_true(used > 0.95 * VIEWS * 1000);
	assert_true(sum / 1000 < 2);
}

/* The one that boasts puts those in doubt who contradict it, and hides the other one so. */
static void two_of_ten_that_lie_are_found_where_one_boasts(void **state)
{
	struct rng rng;
	struct sighting sightings[ALL_VIEWS];
	struct fix fix;
	int found = 0;

	(void)state;
	rng_init(&rng, 15, 0);
	for (int trial = 0; trial < 500; trial++) {
		struct vec3 p = random_point(&rng);

		sight_with_liar(&rng, p, ALL_VIEWS, 0.03, 0, sightings);
		sightings[3].sigma_px = 0.01;
		move_aside(1.5, 6.28 * rng_uniform(&rng), &sightings[3]);
		sightings[6].sigma_px = 0.09;
		move_aside(1, 6.28 * rng_uniform(&rng), &sightings[6]);
		assert_int_equal(triangulate(sightings, ALL_VIEWS, NULL, &fix), 0);
		found += fix.used_mask == 0x3b7 && vec3_distance(fix.p_stage_m, p) < 2e-4;
	}
	print_message("# %d of 500\n", found);
	assert_true(found > 490);
}

/* It has the point where it wants it, so that each of the others is farther off than it is. */
static void one_of_seven_that_boasts_is_found(void **state)
{
	struct rng rng;
	struct sighting sightings[ALL_VIEWS];
	struct fix fix;
	int found = 0;

	(void)state;
	rng_init(&rng, 16, 0);
	for (int trial = 0; trial < 500; trial++) {
		struct vec3 p = random_point(&rng);

		sight_with_liar(&rng, p, 7, 0.05, 0, sightings);
		sightings[3].sigma_px = 0.007;
		move_aside(1.2, 6.28 * rng_uniform(&rng), &sightings[3]);
		assert_int_equal(triangulate(sightings, 7, NULL, &fix), 0);
		found += !(fix.used_mask & 1u << 3) && vec3_distance(fix.p_stage_m, p) < 2e-4;
	}
	print_message("# %d of 500\n", found);
	assert_true(found > 480);
}

/* Beside halves of spots that are not exact enough to contradict it. */
static void a_touching_spot_may_be_both(void **state)
{
	struct rng rng;
	struct sighting sightings[3];
	struct fix fix;
	double sum = 0;

	(void)state;
	rng_init(&rng, 16, 0);
	for (int trial = 0; trial < 2000; trial++) {
		struct vec3 p = random_point(&rng);

		sight_with_liar(&rng, p, 3, 0.22, 0, sightings);
		assert_true(view_project(&views[0], p, sightings[0].pixel, NULL));
		sightings[0].sigma_px = 0.04;
		sightings[0].flags = BLOB_MERGED;
		if (trial % 10 == 0)
			move_aside(1, 6.28 * rng_uniform(&rng), &sightings[0]);
		assert_int_equal(triangulate(sightings, 3, NULL, &fix), 0);
		sum += squared_sigmas(vec3_sub(fix.p_stage_m, p), fix.cov_m2) / 3;
	}
	print_message("# nees / 3 = %.2f\n", sum / 2000);
	assert_true(sum / 2000 < 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(exact_pixels_give_the_exact_point),
		cmocka_unit_test(covariances_are_true_for_two_to_six_views),
		cmocka_unit_test(a_view_one_pixel_off_is_left_out),
		cmocka_unit_test(good_views_are_kept),
		cmocka_unit_test(points_project_together_as_one_by_one),
		cmocka_unit_test(a_view_far_off_pulls_nobody),
		cmocka_unit_test(covariances_are_true_where_it_is_not_plain_who_lies),
		cmocka_unit_test(a_poor_view_is_used_and_the_covariance_says_so),
		cmocka_unit_test(a_merged_blob_is_the_first_to_be_suspected),
		cmocka_unit_test(who_was_outvoted_is_suspected_again),
		cmocka_unit_test(sigmas_that_are_all_too_small_leave_no_view_out),
		cmocka_unit_test(one_of_seven_that_boasts_is_found),
		cmocka_unit_test(two_of_ten_that_lie_are_found_where_one_boasts),
		cmocka_unit_test(a_touching_spot_may_be_both),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_views, free_views);
}
