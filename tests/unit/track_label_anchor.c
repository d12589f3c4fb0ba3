/*
 * A marker that comes back on a cheek of nine in a square, its neighbours named or hidden still.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"

enum { BACK = CHEEK_MIDDLE, CORNER = CHEEK_COUNT - 1 };

static void hide(uint32_t label, double sigma_m)
{
	l.seen[label] = l.motion.labels[label].recent = false;
	l.predictions.labels[label].sigma_m = sigma_m;
}

/* All hold their names for a second, but for the one in the middle. */
static int make_cheek(void **test_state)
{
	(void)test_state;
	wear_cheek();
	for (int i = 0; i < CHEEK_COUNT; i++) {
		struct prediction p = {layout.markers[i].neutral_m, 0.0005, true};

		l.motion.labels[i] = l.predictions.labels[i] = p;
		l.seen[i] = true;
		l.seen_m[i] = p.local_m;
		state.labels[i].confirmed = true;
		state.labels[i].named_s = 1;
	}
	l.motion.labels[BACK].recent = false;
	return 0;
}

static void those_who_hold_their_names_give_one(void **test_state)
{
	(void)test_state;
	assert_true(label_is_anchored(&l, &state, BACK));
}

static void a_point_far_from_where_they_tell_has_no_name(void **test_state)
{
	(void)test_state;
	l.seen_m[BACK].x += 0.4 * CHEEK_SPACING_M;
	assert_false(label_is_anchored(&l, &state, BACK));
}

static void names_just_given_give_none(void **test_state)
{
	(void)test_state;
	for (int i = 0; i < CHEEK_COUNT; i++)
		state.labels[i].named_s = 0.1;
	assert_false(label_is_anchored(&l, &state, BACK));
}

static void a_hidden_label_that_could_mean_the_point_forbids_it(void **test_state)
{
	(void)test_state;
	hide(CORNER, 0.0005);
	assert_true(label_is_anchored(&l, &state, BACK));
	l.predictions.labels[CORNER].local_m = l.seen_m[BACK];
	assert_false(label_is_anchored(&l, &state, BACK));
}

static void skin_keeps_a_vague_neighbour_at_its_distance(void **test_state)
{
	(void)test_state;
	hide(CORNER, 0.01);
	assert_true(label_is_anchored(&l, &state, BACK));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(those_who_hold_their_names_give_one, make_cheek),
		cmocka_unit_test_setup(a_point_far_from_where_they_tell_has_no_name, make_cheek),
		cmocka_unit_test_setup(names_just_given_give_none, make_cheek),
		cmocka_unit_test_setup(a_hidden_label_that_could_mean_the_point_forbids_it,
				       make_cheek),
		cmocka_unit_test_setup(skin_keeps_a_vague_neighbour_at_its_distance, make_cheek),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
