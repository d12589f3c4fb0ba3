/*
 * Masked areas: what they take, to the pixel's edge, and what they leave.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/blobs/mask.h"
#include "track/blobs/mask_find.h"

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

static void shine(float x_px, float y_px, float spread_px2)
{
	set.blobs[set.blob_count++] =
		(struct blob){.x_px = x_px, .y_px = y_px, .shape_px2 = {spread_px2, 0, spread_px2}};
}

/* A lamp, a dim hot place that is missed now and then, and an actor's moving spot. */
static void steady_lights_are_masked_and_moving_ones_are_not(void **state)
{
	static struct mask_finder finder;
	struct mask_finding finding;
	struct mask mask;

	(void)state;
	mask_finder_reset(&finder);
	for (int i = 0; i < 30; i++) {
		set.blob_count = 0;
		shine(100.2f + 0.1f * (float)(i % 3), 50, 25);
		if (i % 10)
			shine(300, 200, 1);
		shine(20.0f + 15 * (float)i, 120, 2);
		mask_finder_add(&finder, &set);
	}
	finding = mask_finder_result(&finder, 640, 512, &mask);
	assert_int_equal(finding.steady_count, 2);
	assert_int_equal(mask.area_count, 2);
	assert_true(finding.unsteady_per_set > 0.9 && finding.unsteady_per_set < 1.1);
	assert_int_equal(taken_at(&mask, 110, 55), 1);
	assert_int_equal(taken_at(&mask, 301, 203), 1);
	assert_int_equal(taken_at(&mask, 320, 120), 0);
}

static void more_lights_than_areas_are_all_masked(void **state)
{
	static struct mask_finder finder;
	struct mask mask;
	struct rng rng;
	float x[60], y[60];

	(void)state;
	rng_init(&rng, 1, 1);
	for (int b = 0; b < 60; b++) {
		x[b] = (float)(640 * rng_uniform(&rng));
		y[b] = (float)(512 * rng_uniform(&rng));
	}
	mask_finder_reset(&finder);
	for (int i = 0; i < 10; i++) {
		set.blob_count = 0;
		for (int b = 0; b < 60; b++)
			shine(x[b], y[b], 2);
		mask_finder_add(&finder, &set);
	}
	mask_finder_result(&finder, 640, 512, &mask);
	assert_int_equal(mask.area_count, MASK_AREA_MAX);
	for (int b = 0; b < 60; b++)
		assert_int_equal(taken_at(&mask, x[b], y[b]), 1);
	for (uint32_t a = 0; a < mask.area_count; a++)
		assert_true(mask.areas[a].x_px >= 0 && mask.areas[a].y_px >= 0 &&
			    mask.areas[a].x_px + mask.areas[a].width_px <= 640 &&
			    mask.areas[a].y_px + mask.areas[a].height_px <= 512);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_area_reaches_to_the_edges_of_its_pixels),
		cmocka_unit_test(what_is_left_keeps_its_order),
		cmocka_unit_test(an_empty_mask_takes_nothing),
		cmocka_unit_test(steady_lights_are_masked_and_moving_ones_are_not),
		cmocka_unit_test(more_lights_than_areas_are_all_masked),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
