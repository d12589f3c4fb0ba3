/*
 * Where a hidden marker is expected when its neighbours and the whole face tell of two places.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"

#define SIDE 3
#define SPACING_M 0.01
#define FACE_SIGMA_M 0.001

enum { HIDDEN = 4, LABELS = SIDE * SIDE };

static struct predictions predictions;
static bool seen[LABEL_MAX];
static struct vec3 seen_m[LABEL_MAX];

/* All but the middle one are seen at rest. */
static int make_cheek(void **test_state)
{
	struct layout_marker markers[LABELS];

	(void)test_state;
	for (int i = 0; i < LABELS; i++)
		markers[i] = (struct layout_marker){
			.neutral_m = {SPACING_M * (i % SIDE), SPACING_M * (i / SIDE), 0.1}};
	wear(markers, LABELS);
	for (int i = 0; i < LABELS; i++) {
		seen[i] = i != HIDDEN;
		seen_m[i] = markers[i].neutral_m;
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

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(who_agree_are_as_sure_as_the_surer, make_cheek),
		cmocka_unit_test_setup(who_contradict_each_other_are_not_sure, make_cheek),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
