/*
 * Rigid fits recover a known pose, and say so when there is none to recover.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/rigid.h"

static struct vec3 random_vector(struct rng *rng, double scale)
{
	double x = rng_normal(rng), y = rng_normal(rng), z = rng_normal(rng);

	return vec3_scale((struct vec3){x, y, z}, scale);
}

static void recovers_a_random_pose(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 0);
	for (int trial = 0; trial < 500; trial++) {
		struct pose truth = pose_from_rotation_vector(random_vector(&rng, 1.5)), found;
		struct rigid_pair pairs[5];

		truth.t = random_vector(&rng, 1);
		for (int i = 0; i < 5; i++) {
			pairs[i].from = random_vector(&rng, 0.1);
			pairs[i].to = pose_apply(&truth, pairs[i].from);
			pairs[i].weight = 0.5 + rng_uniform(&rng);
		}
		assert_int_equal(rigid_fit(pairs, trial % 2 ? 5 : 3, &found), 0);
		for (int i = 0; i < 3; i++)
			assert_true(rigid_error(&pairs[i], &found) < 1e-9);
	}
}

static void half_a_turn_is_no_special_case(void **state)
{
	struct pose truth = pose_from_rotation_vector((struct vec3){0, M_PI, 0}), found;
	struct vec3 from[4] = {{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {0.1, 0.1, 0}};
	struct rigid_pair pairs[4];

	(void)state;
	for (int i = 0; i < 4; i++)
		pairs[i] = (struct rigid_pair){from[i], pose_apply(&truth, from[i]), 1};
	assert_int_equal(rigid_fit(pairs, 4, &found), 0);
	for (int i = 0; i < 4; i++)
		assert_true(rigid_error(&pairs[i], &found) < 1e-9);
}

static void points_on_a_line_have_no_pose(void **state)
{
	struct rigid_pair pairs[4];
	struct pose found;

	(void)state;
	for (int i = 0; i < 4; i++) {
		struct vec3 p = {0.01 * i, 0.02 * i, 0};
		pairs[i] = (struct rigid_pair){p, p, 1};
	}
	assert_int_equal(rigid_fit(pairs, 4, &found), -EDOM);
	assert_int_equal(rigid_fit(pairs, 2, &found), -EDOM);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(recovers_a_random_pose),
		cmocka_unit_test(half_a_turn_is_no_special_case),
		cmocka_unit_test(points_on_a_line_have_no_pose),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
