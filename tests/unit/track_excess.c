/*
 * What is learned of a rig from how well its views agree.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "track/excess.h"

enum { POINTS = 70, SHOTS = 60 };

static struct matcher matcher;
static struct tracker_state state;

static int make_points(void **test_state)
{
	(void)test_state;
	memset(&matcher, 0, sizeof(matcher));
	memset(&state, 0, sizeof(state));
	matcher.point_count = POINTS;
	for (int p = 0; p < POINTS; p++)
		matcher.points[p].fix = (struct fix){.used_count = 3, .chi2_per_dof = 1};
	return 0;
}

static double learned_px(int bad, double chi2_per_dof)
{
	for (int p = 0; p < bad; p++)
		matcher.points[p].fix.chi2_per_dof = chi2_per_dof;
	for (int n = 0; n < SHOTS; n++)
		excess_learn(&state, &matcher);
	print_message("# %d of %d: %.4f px\n", bad, POINTS, sqrt(state.excess.all_px2));
	return sqrt(state.excess.all_px2);
}

static void views_that_agree_teach_nothing(void **test_state)
{
	(void)test_state;
	assert_true(learned_px(0, 1) < 1e-6);
}

static void a_mixed_point_does_not_speak_for_the_rig(void **test_state)
{
	(void)test_state;
	assert_true(learned_px(2, 100) < 1e-6);
}

static void a_rig_that_is_off_is_told_by_many(void **test_state)
{
	(void)test_state;
	assert_true(learned_px(POINTS / 5, 100) > 0.05);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(views_that_agree_teach_nothing, make_points),
		cmocka_unit_test_setup(a_mixed_point_does_not_speak_for_the_rig, make_points),
		cmocka_unit_test_setup(a_rig_that_is_off_is_told_by_many, make_points),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
