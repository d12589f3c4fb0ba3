/*
 * Which points may have a name, by what their views are: spots of one marker, of two, and halves.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "track/match/point_views.h"

enum { VIEWS = 4, HALF = 0, OTHER_HALF = 1 };

static struct matcher matcher;
static struct blob blobs[VIEWS];
static struct point point;

/* Four plain spots that agree. */
static int make_point(void **state)
{
	(void)state;
	memset(&matcher, 0, sizeof(matcher));
	matcher.camera_count = VIEWS;
	point = (struct point){.fix = {.used_mask = 0xf, .used_count = VIEWS, .chi2_per_dof = 1}};
	for (int c = 0; c < VIEWS; c++) {
		blobs[c] = (struct blob){.sigma_px = 0.03F};
		matcher.cameras[c].blobs = &blobs[c];
	}
	return 0;
}

/* The first views are of spots of two markers. */
static void merge(int count, float sigma_px)
{
	for (int c = 0; c < count; c++) {
		blobs[c].flags = BLOB_MERGED;
		blobs[c].sigma_px = sigma_px;
	}
}

/* All views are halves; the other one is some point's in so many of them. */
static void halve(int owned)
{
	for (int c = 0; c < VIEWS; c++) {
		matcher.cameras[c].blobs = matcher.parted[c];
		matcher.parted[c][HALF] = (struct blob){.sigma_px = 0.22F, .flags = BLOB_MERGED};
		matcher.other_half[c][HALF] = OTHER_HALF;
		matcher.other_half[c][OTHER_HALF] = HALF;
		matcher.part_label[c][OTHER_HALF] = 1;
		matcher.cameras[c].owner[OTHER_HALF] = c < owned ? 0 : -1;
	}
}

static void plain_views_that_agree_may_have_any_name(void **state)
{
	(void)state;
	assert_false(point_is_merged(&matcher, &point));
	assert_false(point_is_unsure(&matcher, &point));
	assert_false(point_is_strained(&matcher, &point));
}

static void what_most_views_have_in_one_spot_is_merged(void **state)
{
	(void)state;
	merge(2, 1);
	assert_false(point_is_merged(&matcher, &point));
	merge(3, 1);
	assert_true(point_is_merged(&matcher, &point));
	merge(3, 0.22F); /* parts of a spot know their place */
	assert_false(point_is_merged(&matcher, &point));
}

static void views_that_contradict_or_hardly_tell_are_strained(void **state)
{
	(void)state;
	point.fix.chi2_per_dof = 9.5;
	assert_true(point_is_strained(&matcher, &point));
	point.fix.chi2_per_dof = 1;
	merge(1, 1);
	assert_false(point_is_strained(&matcher, &point));
	merge(2, 1);
	assert_true(point_is_strained(&matcher, &point));
}

static void halves_alone_need_three_whose_other_half_is_known(void **state)
{
	(void)state;
	halve(3);
	assert_false(point_is_unsure(&matcher, &point));
	assert_true(point_is_strained(&matcher, &point));
	halve(2);
	assert_true(point_is_unsure(&matcher, &point));
	halve(1);
	matcher.parted[3][HALF].flags = 0;
	matcher.other_half[3][HALF] = BLOB_NONE;
	assert_false(point_is_unsure(&matcher, &point));
	assert_false(point_is_strained(&matcher, &point));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(plain_views_that_agree_may_have_any_name, make_point),
		cmocka_unit_test_setup(what_most_views_have_in_one_spot_is_merged, make_point),
		cmocka_unit_test_setup(views_that_contradict_or_hardly_tell_are_strained,
				       make_point),
		cmocka_unit_test_setup(halves_alone_need_three_whose_other_half_is_known,
				       make_point),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
