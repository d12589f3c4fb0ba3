/*
 * Where a hidden marker is expected when its neighbours and the whole face tell of two places, and
 * which point may be it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"

#define FACE_SIGMA_M 0.001

enum { HIDDEN = CHEEK_MIDDLE };

static struct predictions predictions;
static bool seen[LABEL_MAX];
static struct vec3 seen_m[LABEL_MAX];

/* All but the middle one are seen at rest. */
static int make_cheek(void **test_state)
{
	(void)test_state;
	wear_cheek();
	for (int i = 0; i < CHEEK_COUNT; i++) {
		seen[i] = i != HIDDEN;
		seen_m[i] = layout.markers[i].neutral_m;
	}
	return 0;
}

/* The face has the hidden one so far from where its neighbours do. */
static struct prediction expect_between(double apart_m)
{
	static struct predictions motion;
	static struct told told[LABEL_MAX];

	predict_motion(&state, 1000000000, &motion);
	told[HIDDEN] = (struct told){true, seen_m[0], FACE_SIGMA_M};
	told[HIDDEN].local_m = state.labels[HIDDEN].master_m;
	told[HIDDEN].local_m.z += apart_m;
	predict_from_neighbours(&state, 1000000000, &motion, seen, seen_m, told, &predictions);
	return predictions.labels[HIDDEN];
}

static void who_agree_are_as_sure_as_the_surer(void **test_state)
{
	(void)test_state;
	struct prediction p = expect_between(0.0005);

	print_message("# agreed: sigma %.2f mm\n", 1e3 * p.sigma_m);
	assert_true(p.sigma_m <= FACE_SIGMA_M);
}

static void who_contradict_each_other_are_not_sure(void **test_state)
{
	(void)test_state;
	for (double apart_m = 0.01; apart_m < 0.035; apart_m += 0.01) {
		struct prediction p = expect_between(apart_m);
		double off_m = fmin(p.local_m.z - 0.1, 0.1 + apart_m - p.local_m.z);

		print_message("# %.0f mm apart: sigma %.2f mm\n", 1e3 * apart_m, 1e3 * p.sigma_m);
		assert_true(off_m < 1e-6); /* at one of the two places ... */
		assert_true(p.sigma_m > 0.3 * apart_m);
	}
}

/* The label that was given the one point, so far from where the hidden one is expected. */
static int named_by_label_points(double off_m, bool is_strained)
{
	static struct point point;
	int row = -1;

	point = (struct point){.claimed_mask = 7, .label = LABEL_NONE};
	point.fix = (struct fix){.p_stage_m = state.labels[HIDDEN].master_m, .used_count = 3};
	point.fix.p_stage_m.z += off_m;
	predict_motion(&state, 1000000000, &l.motion);
	l.is_strained[0] = is_strained;
	nearby_build(&l.nearby, &point, 1, NULL);
	label_points(&l, &state, &point, 1, 1000000000);
	for (int i = 0; i < CHEEK_COUNT; i++)
		row = l.assign.column_of_row[i] == 0 ? i : row;
	return row;
}

static void views_that_hardly_agree_are_a_marker_only_where_it_is_expected(void **test_state)
{
	(void)test_state;
	assert_int_equal(named_by_label_points(0.003, false), HIDDEN);
	assert_int_equal(named_by_label_points(0.001, true), HIDDEN);
	assert_int_equal(named_by_label_points(0.003, true), -1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(who_agree_are_as_sure_as_the_surer, make_cheek),
		cmocka_unit_test_setup(who_contradict_each_other_are_not_sure, make_cheek),
		cmocka_unit_test_setup(
			views_that_hardly_agree_are_a_marker_only_where_it_is_expected, make_cheek),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
