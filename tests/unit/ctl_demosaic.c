/*
 * Colour from a mosaic.
 */
#include "ctl/camera/demosaic.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define WIDTH 10
#define HEIGHT 8

/* What a sensor makes of one colour everywhere, or of a slope of it along x. */
static void expose(uint8_t *mosaic, const int colour[3], int slope)
{
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++)
			mosaic[y * WIDTH + x] = (uint8_t)(colour[(x & 1) + (y & 1)] + slope * x);
}

static void an_even_colour_stays_even_to_the_border(void **state)
{
	const int colour[3] = {200, 120, 40};
	uint8_t mosaic[WIDTH * HEIGHT], rgb[3 * WIDTH * HEIGHT];

	(void)state;
	expose(mosaic, colour, 0);
	demosaic(mosaic, WIDTH, HEIGHT, PIXEL_BAYER_RG8, rgb);
	for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
		assert_int_equal(rgb[i], colour[i % 3]);
}

static void a_slope_is_continued_between_the_pixels(void **state)
{
	const int colour[3] = {100, 60, 20};
	uint8_t mosaic[WIDTH * HEIGHT], rgb[3 * WIDTH * HEIGHT];

	(void)state;
	expose(mosaic, colour, 6);
	demosaic(mosaic, WIDTH, HEIGHT, PIXEL_BAYER_RG8, rgb);
	for (int y = 1; y < HEIGHT - 1; y++)
		for (int x = 1; x < WIDTH - 1; x++)
			for (int k = 0; k < 3; k++)
				assert_int_equal(rgb[3 * (y * WIDTH + x) + k], colour[k] + 6 * x);
}

static void the_smallest_mosaic_is_one_cell(void **state)
{
	const uint8_t mosaic[4] = {90, 50, 70, 10};
	uint8_t rgb[12];

	(void)state;
	demosaic(mosaic, 2, 2, PIXEL_BAYER_RG8, rgb);
	for (int i = 0; i < 4; i++) {
		assert_int_equal(rgb[3 * i], 90);
		assert_int_equal(rgb[3 * i + 1], i == 1 ? 50 : i == 2 ? 70 : 60);
		assert_int_equal(rgb[3 * i + 2], 10);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_even_colour_stays_even_to_the_border),
		cmocka_unit_test(a_slope_is_continued_between_the_pixels),
		cmocka_unit_test(the_smallest_mosaic_is_one_cell),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
