/*
 * The blob finder on pictures whose truth is known.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "track_blobs_spots.h"

static void a_spot_is_found_where_it_is(void **state)
{
	struct picture picture = picture_create(320, 240, 10);
	struct true_spot spot = {100.3, 80.7, 4, 1, 0, 0.8, 150};
	struct blob_settings settings = blob_settings_default();
	static struct blob_set set;
	struct blob_finder *finder;
	struct grey_image image;
	struct rng rng;

	(void)state;
	rng_init(&rng, 1, 1);
	picture_add(&picture, &spot, 2);
	picture_expose(&picture, 2, &rng);
	image = picture_image(&picture);
	assert_int_equal(blob_finder_create(&finder, 320, 240, &settings), 0);
	blob_finder_run(finder, &image, &set);
	assert_int_equal(set.blob_count, 1);
	assert_true(fabs((double)set.blobs[0].x_px - spot.x_px) < 0.05);
	assert_true(fabs((double)set.blobs[0].y_px - spot.y_px) < 0.05);
	blob_finder_destroy(finder);
	picture_destroy(&picture);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_spot_is_found_where_it_is),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
