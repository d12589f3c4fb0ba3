/*
 * Points by place: the nearest one is found, and a mix of several markers' views is none.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/match/nearby.h"

#define COUNT 300

static struct point points[COUNT];
static struct nearby nearby;

static void scatter(struct rng *rng)
{
	memset(points, 0, sizeof(points));
	for (int i = 0; i < COUNT; i++) {
		double x = rng_normal(rng), y = rng_normal(rng), z = rng_normal(rng);

		points[i].fix.p_stage_m = (struct vec3){0.1 * x, 0.1 * y, 0.1 * z};
		points[i].fix.chi2_per_dof = 1;
		points[i].claimed_mask = 7;
	}
}

static void the_nearest_point_is_found(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 1);
	scatter(&rng);
	nearby_build(&nearby, points, COUNT, NULL);
	assert_int_equal(nearby.count, COUNT);
	for (int i = 0; i < COUNT; i++) {
		struct vec3 place_m = vec3_scale(points[i].fix.p_stage_m, 0.9);
		double least_m = 0.05, distance2_m2;
		int nearest = -1;

		for (int k = 0; k < COUNT; k++) {
			double distance_m = vec3_distance(points[k].fix.p_stage_m, place_m);

			nearest = distance_m < least_m ? k : nearest;
			least_m = distance_m < least_m ? distance_m : least_m;
		}
		int entry = nearby_nearest(&nearby, place_m, 0.05, &distance2_m2);
		assert_int_equal(entry < 0 ? -1 : nearby.point[entry], nearest);
	}
}

static void views_that_contradict_each_other_are_of_no_marker(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 1);
	scatter(&rng);
	points[5].fix.chi2_per_dof = 100;
	points[5].fix.used_count = 3;
	points[9].claimed_mask = 3; /* two cameras */
	nearby_build(&nearby, points, COUNT, NULL);
	assert_int_equal(nearby.count, COUNT - 2);
	for (int k = 0; k < nearby.count; k++)
		assert_true(nearby.point[k] != 5 && nearby.point[k] != 9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_nearest_point_is_found),
		cmocka_unit_test(views_that_contradict_each_other_are_of_no_marker),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
