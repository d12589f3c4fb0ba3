/*
 * Lips that part, meet and are one spot, on a mouth of two markers and a cheek; and what is left
 * over in pairs.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"

enum { UPPER, LOWER, CHEEK, ABOUT, LABELS = ABOUT + 3 };

static const struct layout_marker MARKERS[LABELS] = {
	{.name = "u", .group = "lip_upper", .neutral_m = {0, 0.004, 0.1}},
	{.name = "d", .group = "lip_lower", .neutral_m = {0, -0.004, 0.1}},
	{.name = "c", .group = "cheek", .neutral_m = {0.03, 0.01, 0.09}},
	{.name = "e", .group = "cheek", .neutral_m = {0.06, 0.01, 0.07}},
	{.name = "f", .group = "cheek", .neutral_m = {0.05, 0.03, 0.07}},
	{.name = "g", .group = "cheek", .neutral_m = {0.05, -0.02, 0.07}},
};

static struct point points[LABELS];

/* A face seen a moment ago; up in the head is -x on the stage. */
static int make_face(void **test_state)
{
	(void)test_state;
	wear(MARKERS, LABELS);
	l.rt_stage_frame[0] =
		(struct pose){.r = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, .t = {1, 2, 3}};
	l.rt_frame_stage[0] = pose_inverse(&l.rt_stage_frame[0]);
	l.assign.row_count = l.assign.column_count = LABELS;
	for (int i = 0; i < LABELS; i++) {
		state.labels[i].confirmed = true;
		state.labels[i].local_m = MARKERS[i].neutral_m;
		l.predictions.labels[i] = (struct prediction){MARKERS[i].neutral_m, 0.0005, true};
		l.expected_m[i] = pose_apply(&l.rt_stage_frame[0], MARKERS[i].neutral_m);
		l.assign.column_of_row[i] = l.assign.row_of_column[i] = ASSIGN_NONE;
		l.point_of_label[i] = ASSIGN_NONE;
	}
	return 0;
}

/* A point of three views, given to the label, or to nobody. */
static void add_point(int column, struct vec3 local_m, int row)
{
	points[column].fix.p_stage_m = pose_apply(&l.rt_stage_frame[0], local_m);
	points[column].fix.used_count = 3;
	points[column].fix.used_mask = 7;
	points[column].claimed_mask = 7;
	l.assign.row_of_column[column] = (int16_t)row;
	if (row == ASSIGN_NONE)
		return;
	l.assign.column_of_row[row] = (int16_t)column;
	l.seen_m[row] = local_m;
	l.seen[row] = true;
}

static void nearest_across_is_below(void **test_state)
{
	(void)test_state;
	assert_int_equal(state.labels[UPPER].below, LOWER);
	assert_int_equal(state.labels[LOWER].below, LABEL_NONE);
	assert_int_equal(state.labels[CHEEK].below, LABEL_NONE);
	assert_true(label_order_tells(&state, UPPER, LOWER));
	assert_true(label_order_tells(&state, LOWER, UPPER));
	assert_false(label_order_tells(&state, UPPER, CHEEK));
	assert_false(label_order_tells(&state, UPPER, ASSIGN_NONE));
}

static void lips_the_wrong_way_round_are_exchanged(void **test_state)
{
	(void)test_state;
	add_point(0, (struct vec3){0, -0.002, 0.1}, UPPER);
	add_point(1, (struct vec3){0.001, 0.003, 0.1}, LOWER);
	add_point(2, MARKERS[CHEEK].neutral_m, CHEEK);
	label_put_in_order(&l, &state, points);
	assert_int_equal(l.assign.column_of_row[UPPER], 1);
	assert_int_equal(l.assign.column_of_row[LOWER], 0);
	assert_int_equal(l.assign.row_of_column[0], LOWER);
	assert_int_equal(l.assign.row_of_column[1], UPPER);
	assert_int_equal(l.assign.column_of_row[CHEEK], 2);
}

static void who_are_exchanged_take_no_point_whose_views_hardly_agree(void **test_state)
{
	(void)test_state;
	add_point(0, (struct vec3){0, -0.002, 0.1}, UPPER);
	add_point(1, (struct vec3){0.001, 0.003, 0.1}, LOWER);
	l.is_strained[0] = true;
	label_put_in_order(&l, &state, points);
	assert_int_equal(l.assign.column_of_row[UPPER], 1);
	assert_int_equal(l.assign.column_of_row[LOWER], ASSIGN_NONE);
	assert_int_equal(l.assign.row_of_column[0], ASSIGN_NONE);
}

static void lips_in_order_and_single_ones_stay(void **test_state)
{
	(void)test_state;
	add_point(0, MARKERS[UPPER].neutral_m, UPPER);
	add_point(1, MARKERS[LOWER].neutral_m, LOWER);
	label_put_in_order(&l, &state, points);
	assert_int_equal(l.assign.column_of_row[UPPER], 0);
	assert_int_equal(l.assign.column_of_row[LOWER], 1);
	l.assign.column_of_row[LOWER] = ASSIGN_NONE;
	label_put_in_order(&l, &state, points);
	assert_int_equal(l.assign.column_of_row[UPPER], 0);
}

/* The lower one has no point, and was last seen `apart_m` below the upper one's. */
static void press(double apart_m)
{
	struct vec3 seen_m = MARKERS[UPPER].neutral_m;

	add_point(0, seen_m, UPPER);
	seen_m.y -= apart_m;
	state.labels[LOWER].local_m = l.predictions.labels[LOWER].local_m = seen_m;
	label_doubt_pressed(&l, &state);
}

static void pressed_lips_have_no_name(void **test_state)
{
	(void)test_state;
	press(0.002);
	assert_true(l.doubtful[UPPER]);
	assert_true(l.doubtful[LOWER]);
	assert_false(l.doubtful[CHEEK]);
}

/* The lower one has a point of two cameras that lies so much below the upper one's. */
static void press_between_two_cameras(double apart_m)
{
	l.point_of_label[LOWER] = 1;
	l.seen_m[LOWER] = MARKERS[UPPER].neutral_m;
	l.seen_m[LOWER].y -= apart_m;
	l.point_of_label[UPPER] = 0;
	press(0.002);
}

static void lips_that_two_cameras_part_keep_their_names(void **test_state)
{
	(void)test_state;
	press_between_two_cameras(0.0024);
	assert_false(l.doubtful[UPPER]);
	assert_false(l.doubtful[LOWER]);
	label_doubt_lonely(&l, &state);
	assert_int_equal(l.point_of_label[UPPER], 0);
	assert_int_equal(l.point_of_label[LOWER], 1);
}

static void lips_that_two_cameras_have_upside_down_have_no_name(void **test_state)
{
	(void)test_state;
	press_between_two_cameras(-0.0024);
	assert_true(l.doubtful[UPPER]);
	assert_true(l.doubtful[LOWER]);
	label_doubt_lonely(&l, &state);
	assert_int_equal(l.point_of_label[UPPER], ASSIGN_NONE);
	assert_int_equal(l.point_of_label[LOWER], ASSIGN_NONE);
}

static void a_lip_hidden_elsewhere_doubts_nobody(void **test_state)
{
	(void)test_state;
	press(0.012);
	assert_false(l.doubtful[UPPER]);
	assert_false(l.doubtful[LOWER]);
}

static void a_lip_seen_there_long_ago_doubts_nobody(void **test_state)
{
	(void)test_state;
	l.now_ns = 2000000000;
	add_point(0, MARKERS[UPPER].neutral_m, UPPER);
	state.labels[LOWER].local_m = MARKERS[UPPER].neutral_m;
	l.predictions.labels[LOWER].local_m.y -= 0.01;
	label_doubt_pressed(&l, &state);
	assert_false(l.doubtful[UPPER]);
}

/* The cheek's label has no point where it is expected, but `off_m` aside. */
static void leave_over(double off_m, bool is_ghost)
{
	struct vec3 aside_m = MARKERS[CHEEK].neutral_m;

	aside_m.x += off_m;
	add_point(0, MARKERS[UPPER].neutral_m, UPPER);
	add_point(1, MARKERS[LOWER].neutral_m, LOWER);
	add_point(2, aside_m, ASSIGN_NONE);
	l.is_ghost[2] = is_ghost;
	nearby_build(&l.nearby, points, LABELS, NULL);
	label_pair_left_over(&l, &state);
}

static void left_over_near_each_other_are_a_pair(void **test_state)
{
	(void)test_state;
	leave_over(0.005, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], 2);
	assert_int_equal(l.assign.row_of_column[2], CHEEK);
}

static void far_points_and_known_lights_stay_nobodys(void **test_state)
{
	(void)test_state;
	leave_over(0.02, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], ASSIGN_NONE);
	leave_over(0.005, true);
	assert_int_equal(l.assign.column_of_row[CHEEK], ASSIGN_NONE);
}

static void point_whose_views_hardly_agree_is_no_pair(void **test_state)
{
	(void)test_state;
	l.is_strained[2] = true;
	leave_over(0.005, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], ASSIGN_NONE);
}

/* It was seen in the last shot, and those about it, who tell surely, are seen where they were. The
 * whole face may know better. */
static void a_light_where_nobody_tells_of_it_is_no_pair(void **test_state)
{
	(void)test_state;
	l.motion.labels[CHEEK].recent = true;
	for (int k = 0; k < state.labels[CHEEK].neighbour_count; k++)
		state.labels[CHEEK].neighbours[k].leaves = 0.01;
	for (int i = ABOUT; i < LABELS; i++)
		add_point(i, MARKERS[i].neutral_m, i);
	leave_over(0.006, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], ASSIGN_NONE);
	l.told[CHEEK] = (struct told){.known = true, .sigma_m = 1e-4};
	l.told[CHEEK].local_m = vec3_add(MARKERS[CHEEK].neutral_m, (struct vec3){0.006, 0, 0});
	leave_over(0.006, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], 2);
}

static void what_two_labels_could_mean_is_no_pair(void **test_state)
{
	(void)test_state;
	l.expected_m[LOWER] = l.expected_m[CHEEK];
	leave_over(0.005, false);
	assert_int_equal(l.assign.column_of_row[CHEEK], ASSIGN_NONE);
}

/* Of a pair that hid, the upper one is expected 2 mm under the lower. */
static void lips_are_not_expected_to_pass_through_each_other(void **test_state)
{
	struct predictions *p = &l.predictions;

	(void)test_state;
	p->labels[UPPER] = (struct prediction){{0, -0.001, 0.1}, 0.001, true};
	p->labels[LOWER] = (struct prediction){{0, 0.001, 0.1}, 0.002, true};
	state.labels[UPPER].diameter_m = 0.0015;
	label_expect_in_order(&state, p);
	assert_true(fabs(p->labels[UPPER].local_m.y - p->labels[LOWER].local_m.y - 0.0015) < 1e-9);
	assert_true(fabs(p->labels[UPPER].local_m.y + 0.001 - 0.0035 / 5) < 1e-9);
	assert_true(p->labels[CHEEK].local_m.y == MARKERS[CHEEK].neutral_m.y);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nearest_across_is_below, make_face),
		cmocka_unit_test_setup(lips_the_wrong_way_round_are_exchanged, make_face),
		cmocka_unit_test_setup(who_are_exchanged_take_no_point_whose_views_hardly_agree,
				       make_face),
		cmocka_unit_test_setup(lips_in_order_and_single_ones_stay, make_face),
		cmocka_unit_test_setup(pressed_lips_have_no_name, make_face),
		cmocka_unit_test_setup(lips_that_two_cameras_part_keep_their_names, make_face),
		cmocka_unit_test_setup(lips_that_two_cameras_have_upside_down_have_no_name,
				       make_face),
		cmocka_unit_test_setup(a_lip_hidden_elsewhere_doubts_nobody, make_face),
		cmocka_unit_test_setup(a_lip_seen_there_long_ago_doubts_nobody, make_face),
		cmocka_unit_test_setup(left_over_near_each_other_are_a_pair, make_face),
		cmocka_unit_test_setup(far_points_and_known_lights_stay_nobodys, make_face),
		cmocka_unit_test_setup(point_whose_views_hardly_agree_is_no_pair, make_face),
		cmocka_unit_test_setup(a_light_where_nobody_tells_of_it_is_no_pair, make_face),
		cmocka_unit_test_setup(what_two_labels_could_mean_is_no_pair, make_face),
		cmocka_unit_test_setup(lips_are_not_expected_to_pass_through_each_other, make_face),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
