/*
 * A marker of a cheek whose neighbours have it far from where it was a moment ago: what held its
 * name follows them, what was named just now does not. And one that has no name yet.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"
#include "track/label/remember.h"

#define NOW_NS 1000000000
#define PERIOD_NS 8333333

enum { BACK = CHEEK_MIDDLE };

static struct point point;

static void init_label(int i)
{
	struct prediction p = {layout.markers[i].neutral_m, 0.0005, true};

	l.motion.labels[i] = l.predictions.labels[i] = p;
	l.assign.column_of_row[i] = l.point_of_label[i] = ASSIGN_NONE;
	state.labels[i].confirmed = true;
	state.labels[i].seen_ns = NOW_NS - 2 * PERIOD_NS;
	state.labels[i].filled_m = p.local_m;
	state.labels[i].camera_mask = 7;
}

/* One point, three quarters of a spacing from where the marker's own motion has it. */
static int make_cheek(void **test_state)
{
	(void)test_state;
	wear_cheek();
	for (int i = 0; i < CHEEK_COUNT; i++)
		init_label(i);
	state.mid_exposure_ns = NOW_NS - PERIOD_NS;
	state.period_ns = PERIOD_NS;
	l.now_ns = NOW_NS;
	l.predictions.labels[BACK].local_m.z += 0.75 * CHEEK_SPACING_M;
	point = (struct point){.fix = {.used_mask = 7, .used_count = 3}, .label = LABEL_NONE};
	point.fix.p_stage_m = l.predictions.labels[BACK].local_m;
	l.seen[BACK] = true;
	l.assign.column_of_row[BACK] = l.point_of_label[BACK] = 0;
	return 0;
}

static void remember(double named_s)
{
	const bool anchored[FRAME_MAX] = {false};

	state.labels[BACK].named_s = named_s;
	remember_labels(&l, &state, &point, anchored, NOW_NS, 1e-9 * PERIOD_NS);
}

static void a_name_that_held_follows_where_it_is_expected(void **test_state)
{
	(void)test_state;
	remember(1);
	assert_int_equal(point.label, BACK);
}

static void a_young_name_does_not_leap(void **test_state)
{
	(void)test_state;
	remember(0.1);
	assert_int_equal(point.label, LABEL_NONE);
}

static void a_young_name_follows_its_own_motion(void **test_state)
{
	(void)test_state;
	l.motion.labels[BACK].local_m.z += 0.5 * CHEEK_SPACING_M;
	remember(0.1);
	assert_int_equal(point.label, BACK);
}

/* A light comes up beside it, in sight of cameras that do not see the marker. */
static void a_name_that_other_cameras_see_follows_less_far(void **test_state)
{
	(void)test_state;
	l.predictions.labels[BACK].local_m.z -= 0.3 * CHEEK_SPACING_M;
	point.fix.used_mask = 0x3c;
	point.fix.used_count = 4;
	remember(1);
	assert_int_equal(point.label, LABEL_NONE);
	point.fix.used_mask = 0x1e;
	remember(1);
	assert_int_equal(point.label, BACK);
}

/* Two seconds on this point, from nothing. */
static void hold_without_a_name(double way_m)
{
	struct label_state *label = &state.labels[BACK];

	label->confirmed = false;
	label->filled_m = label->steady_from_m = l.predictions.labels[BACK].local_m;
	label->steady_since_ns = NOW_NS - 2000000000LL;
	label->steady_way_m = way_m;
	remember(0);
}

static void holding_still_away_from_rest_proves_nothing(void **test_state)
{
	(void)test_state;
	hold_without_a_name(0.1 * CHEEK_SPACING_M);
	assert_int_equal(point.label, LABEL_NONE);
}

static void holding_while_it_moves_gives_the_name(void **test_state)
{
	(void)test_state;
	hold_without_a_name(0.6 * CHEEK_SPACING_M);
	assert_int_equal(point.label, BACK);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_name_that_held_follows_where_it_is_expected, make_cheek),
		cmocka_unit_test_setup(a_young_name_does_not_leap, make_cheek),
		cmocka_unit_test_setup(a_young_name_follows_its_own_motion, make_cheek),
		cmocka_unit_test_setup(a_name_that_other_cameras_see_follows_less_far, make_cheek),
		cmocka_unit_test_setup(holding_still_away_from_rest_proves_nothing, make_cheek),
		cmocka_unit_test_setup(holding_while_it_moves_gives_the_name, make_cheek),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
