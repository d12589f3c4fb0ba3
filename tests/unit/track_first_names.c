/*
 * A face that is found from nothing: twenty markers in rows, one of them without a point, and one
 * point of no marker. And a head that was found so in the last shot.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"
#include "track/head.h"
#include "track/label/first_names.h"

#define SPACING_M 0.01

enum { ACROSS = 5, LABELS = 20, LONELY = 19 };

static struct point points[LABELS + 1];

static int make_face(void **test_state)
{
	struct layout_marker markers[LABELS];

	(void)test_state;
	for (int i = 0; i < LABELS; i++)
		markers[i] = (struct layout_marker){
			.group = "cheek",
			.neutral_m = {SPACING_M * (i % ACROSS), SPACING_M * (i / ACROSS),
				      0.1 - 0.001 * (i % ACROSS) * (i / ACROSS)}};
	wear(markers, LABELS);
	for (int i = 0; i < LABELS; i++) {
		l.motion.labels[i].local_m = l.seen_m[i] = markers[i].neutral_m;
		l.seen[i] = i != LONELY;
		l.assign.column_of_row[i] = l.seen[i] ? (int16_t)i : ASSIGN_NONE;
		l.assign.row_of_column[i] = l.seen[i] ? (int16_t)i : ASSIGN_NONE;
		points[i] = (struct point){
			.fix = {.p_stage_m = markers[i].neutral_m, .used_mask = 7, .used_count = 3},
			.claimed_mask = 7};
	}
	points[LONELY].fix.p_stage_m.z += 1.5 * SPACING_M;
	nearby_build(&l.nearby, points, LABELS, NULL);
	return 0;
}

static struct leftovers look(void)
{
	struct leftovers leftovers;

	first_names_look(&state, &l, points, &leftovers);
	return leftovers;
}

static void a_label_and_a_point_left_over_hint_at_a_row(void **test_state)
{
	struct leftovers leftovers = look();

	(void)test_state;
	assert_int_equal(first_names_read(&state, &l, &leftovers, LONELY - 1), READING_SHIFTED);
}

static void a_face_on_its_neutral_places_rests(void **test_state)
{
	(void)test_state;
	assert_true(look().rests[0]);
}

static void a_face_of_which_a_row_moved_does_not(void **test_state)
{
	(void)test_state;
	for (int i = 0; i < ACROSS; i++)
		l.seen_m[i].y -= 0.3 * SPACING_M;
	assert_false(look().rests[0]);
}

/* Where its markers go is not known until they were seen twice. */
static void a_head_just_found_is_followed_by_markers_seen_once(void **test_state)
{
	struct pose pose = POSE_IDENTITY;

	(void)test_state;
	l.motion.fresh[0] = false;
	pose.t.x = 0.003;
	assert_true(head_refine(&state, 0, &l.motion, &l.nearby, &pose));
	assert_true(fabs(pose.t.x) < 1e-4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_label_and_a_point_left_over_hint_at_a_row, make_face),
		cmocka_unit_test_setup(a_face_on_its_neutral_places_rests, make_face),
		cmocka_unit_test_setup(a_face_of_which_a_row_moved_does_not, make_face),
		cmocka_unit_test_setup(a_head_just_found_is_followed_by_markers_seen_once,
				       make_face),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
