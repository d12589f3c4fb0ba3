/*
 * Masked areas: what they take, to the pixel's edge, and what they leave.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "track/mask.h"

static struct blob_set set;

static uint32_t taken_at(const struct mask *mask, float x_px, float y_px)
{
	set.blob_count = 1;
	set.blobs[0] = (struct blob){.x_px = x_px, .y_px = y_px};
	return mask_apply(mask, &set);
}

static void an_area_reaches_to_the_edges_of_its_pixels(void **state)
{
	const struct mask mask = {1, {{100, 50, 20, 1}}};

	(void)state;
	assert_int_equal(taken_at(&mask, 99.49f, 50), 0);
	assert_int_equal(taken_at(&mask, 99.51f, 50), 1);
	assert_int_equal(taken_at(&mask, 119.49f, 50), 1);
	assert_int_equal(taken_at(&mask, 119.51f, 50), 0);
	assert_int_equal(taken_at(&mask, 110, 49.49f), 0);
	assert_int_equal(taken_at(&mask, 110, 50.49f), 1);
	assert_int_equal(taken_at(&mask, 110, 50.51f), 0);
}

static void what_is_left_keeps_its_order(void **state)
{
	const struct mask mask = {2, {{0, 0, 10, 1000}, {500, 0, 10, 1000}}};
	static const float x_px[] = {3, 20, 505, 30, 9, 40};

	(void)state;
	set.blob_count = 6;
	for (int b = 0; b < 6; b++)
		set.blobs[b] = (struct blob){.x_px = x_px[b], .y_px = 7};
	assert_int_equal(mask_apply(&mask, &set), 3);
	assert_int_equal(set.blob_count, 3);
	for (int b = 0; b < 3; b++)
		assert_true(set.blobs[b].x_px == (float)(20 + 10 * b));
}

static void an_empty_mask_takes_nothing(void **state)
{
	const struct mask mask = {0};

	(void)state;
	assert_int_equal(taken_at(&mask, 0, 0), 0);
	assert_int_equal(set.blob_count, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_area_reaches_to_the_edges_of_its_pixels),
		cmocka_unit_test(what_is_left_keeps_its_order),
		cmocka_unit_test(an_empty_mask_takes_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
