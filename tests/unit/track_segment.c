/*
 * A forearm of three markers: what comes back to it, and what may not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "track/label/label.h"
#include "track/label/segment.h"

enum { WRIST, MIDDLE, BACK, LABELS, ARM = 1 };

static const struct vec3 PLACES_M[LABELS] = {{0, 0, 0}, {0, 0.06, 0.01}, {0.03, 0.03, 0}};

static struct layout layout;
static struct tracker_state state;
static struct labelling l;
static struct point points[LABELS];

static void hide(int label)
{
	l.seen[label] = l.motion.labels[label].recent = false;
	l.point_of_label[label] = ASSIGN_NONE;
}

/* Two markers were seen a moment ago; all three have a point where they should. */
static int make_arm(void **test_state)
{
	(void)test_state;
	memset(&layout, 0, sizeof(layout));
	memset(&state, 0, sizeof(state));
	memset(&l, 0, sizeof(l));
	layout.actor_count = 1;
	layout.actors[0].count = layout.marker_count = LABELS;
	for (int i = 0; i < LABELS; i++) {
		strcpy(layout.markers[i].segment, "forearm");
		layout.markers[i].neutral_m = PLACES_M[i];
	}
	predict_init(&state, &layout);
	l.found[ARM] = true;
	l.rt_stage_frame[ARM] = POSE_IDENTITY;
	for (int i = 0; i < LABELS; i++) {
		l.motion.labels[i] = (struct prediction){PLACES_M[i], 0.003, i != BACK};
		l.seen[i] = true;
		l.seen_m[i] = points[i].fix.p_stage_m = PLACES_M[i];
		l.point_of_label[i] = (int16_t)i;
	}
	return 0;
}

static struct head fit(void)
{
	struct head head;

	segment_fit(&state, &l, ARM, points, &head);
	return head;
}

static void one_that_comes_back_where_it_belongs_is_taken(void **test_state)
{
	(void)test_state;
	assert_int_equal(fit().rigid_count, LABELS);
	assert_true(l.seen[BACK]);
	assert_true(label_is_clear(&l, &state, BACK));
}

static void one_that_comes_back_drives_out_none_that_was_there(void **test_state)
{
	(void)test_state;
	points[BACK].fix.p_stage_m = (struct vec3){0.023, 0.018, 0.003};
	struct head head = fit();
	struct vec3 middle_m = pose_apply(&head.rt_stage_head, PLACES_M[MIDDLE]);

	assert_false(l.seen[BACK]);
	assert_true(l.seen[WRIST] && l.seen[MIDDLE]);
	assert_int_equal(head.rigid_count, 2);
	assert_true(vec3_distance(middle_m, PLACES_M[MIDDLE]) < 0.001);
}

static void three_that_bend_give_no_name_at_once(void **test_state)
{
	(void)test_state;
	l.seen_m[BACK].x += 0.002;
	assert_false(label_is_clear(&l, &state, BACK));
}

static void one_alone_gives_no_name_at_once(void **test_state)
{
	(void)test_state;
	hide(MIDDLE);
	assert_false(label_is_clear(&l, &state, BACK));
}

static void one_left_is_outvoted_by_two_that_come_back(void **test_state)
{
	(void)test_state;
	l.motion.labels[MIDDLE].recent = false;
	points[WRIST].fix.p_stage_m.x += 0.1;
	fit();
	assert_false(l.seen[WRIST]);
	assert_true(l.seen[MIDDLE] && l.seen[BACK]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(one_that_comes_back_where_it_belongs_is_taken, make_arm),
		cmocka_unit_test_setup(one_that_comes_back_drives_out_none_that_was_there,
				       make_arm),
		cmocka_unit_test_setup(three_that_bend_give_no_name_at_once, make_arm),
		cmocka_unit_test_setup(one_alone_gives_no_name_at_once, make_arm),
		cmocka_unit_test_setup(one_left_is_outvoted_by_two_that_come_back, make_arm),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
