/*
 * What the blob finder does with images as they come: hot pixels, borders, touching spots, garbage;
 * always within its bounds, and always the same.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "track/blobs/blobs_parts.h"
#include "track_blobs_spots.h"

#define WIDTH 320
#define HEIGHT 240

static struct blob_set set;

static struct blob_finder *make_finder(int width_px, int height_px)
{
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;

	assert_int_equal(blob_finder_create(&finder, width_px, height_px, &settings), 0);
	return finder;
}

static void run_once(const struct grey_image *image)
{
	struct blob_finder *finder = make_finder(image->width_px, image->height_px);

	memset(&set, 0, sizeof(set));
	blob_finder_run(finder, image, &set);
	blob_finder_destroy(finder);
}

/* Draws the spots, exposes, finds. */
static void find_in_picture(const struct true_spot *spots, int count, int hot_count,
			    const int (*hot)[2])
{
	struct picture picture = picture_create(WIDTH, HEIGHT, 10);
	struct grey_image image = picture_image(&picture);
	struct rng rng;

	rng_init(&rng, 3, 1);
	for (int i = 0; i < count; i++)
		picture_add(&picture, &spots[i], 2);
	picture_expose(&picture, 2, &rng);
	for (int i = 0; i < hot_count; i++)
		picture.pixels[hot[i][1] * WIDTH + hot[i][0]] = 255;
	run_once(&image);
	picture_destroy(&picture);
}

static void random_levels(struct rng *rng, uint8_t *groups, uint8_t *cells, int group_count)
{
	for (int g = 0; g < group_count; g++) {
		uint8_t lowest = (uint8_t)(rng_u32(rng) % 256);

		memset(groups + g * CELL_PX, lowest, CELL_PX);
		for (int i = 0; i < GROUP_PX; i++)
			cells[g * GROUP_PX + i] = (uint8_t)(rng_u32(rng) % 256);
	}
}

static size_t scan_plainly(const uint8_t *row, int y, const uint8_t *levels, int group_count,
			   struct candidate *out)
{
	size_t count = 0;

	for (int g = 0; g < group_count; g++) {
		bool bright = false;

		for (int b = 0; b < GROUP_PX; b++)
			bright |= row[g * GROUP_PX + b] > levels[g * CELL_PX + b % CELL_PX];
		out[count] = (struct candidate){(uint16_t)y, (uint16_t)g};
		count += bright;
	}
	return count;
}

static uint64_t mask_plainly(const uint8_t *p, const uint8_t *level)
{
	uint64_t mask = 0;

	for (int b = 0; b < GROUP_PX; b++)
		mask |= (uint64_t)(p[b] > level[b]) << b;
	return mask;
}

static void the_scan_finds_what_plain_comparisons_find(void **state)
{
	uint8_t row[16 * GROUP_PX], groups[16 * CELL_PX], cells[16 * GROUP_PX];
	struct candidate simd[17], plain[17];
	struct rng rng;

	(void)state;
	rng_init(&rng, 1, 1);
	for (int i = 0; i < 2000; i++) {
		int group_count = (int)(rng_u32(&rng) % 16);
		uint32_t top = 1 + rng_u32(&rng) % 256;
		size_t count;

		for (size_t k = 0; k < sizeof(row); k++)
			row[k] = (uint8_t)(rng_u32(&rng) % top);
		random_levels(&rng, groups, cells, group_count);
		count = blob_scan(row, i, groups, group_count, simd);
		assert_int_equal(count, scan_plainly(row, i, groups, group_count, plain));
		assert_memory_equal(simd, plain, count * sizeof(*simd));
		for (int g = 0; g < group_count; g++)
			assert_true(blob_mask(row + g * GROUP_PX, cells + g * GROUP_PX) ==
				    mask_plainly(row + g * GROUP_PX, cells + g * GROUP_PX));
	}
}

/* A random picture of this size, in rows of `stride` bytes. */
static struct picture random_picture(int width_px, int height_px, int stride_bytes, uint64_t seed)
{
	struct picture padded = picture_create(stride_bytes, height_px, 12);
	struct rng rng;

	rng_init(&rng, seed, 2);
	for (int i = 0; i < 30; i++)
		picture_add(&padded,
			    &(struct true_spot){rng_uniform(&rng) * width_px,
						rng_uniform(&rng) * height_px,
						2 + 10 * rng_uniform(&rng), 0.6, 1, 0.8,
						30 + 300 * rng_uniform(&rng)},
			    2);
	picture_expose(&padded, 2, &rng);
	return padded;
}

static void both_builds_give_the_same_bits_in_odd_sizes(void **state)
{
	static const int sizes[][3] = {{1, 1, 1},      {7, 3, 8},       {15, 40, 15},
				       {16, 16, 16},   {63, 65, 70},    {64, 64, 64},
				       {65, 9, 96},    {130, 100, 133}, {321, 203, 322},
				       {640, 64, 640}, {577, 300, 600}};
	static struct blob_set again;

	(void)state;
	for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
		int width = sizes[i][0], height = sizes[i][1], stride = sizes[i][2];
		struct picture picture = random_picture(width, height, stride, i);
		struct grey_image image = {picture.pixels, width, height, stride, 8};
		struct blob_finder *finder = make_finder(width, height);

		memset(&again, 0, sizeof(again));
		run_once(&image);
		blob_finder_use(finder, blob_builds_any());
		blob_finder_run(finder, &image, &again);
		assert_memory_equal(&set, &again, sizeof(set));
		blob_finder_destroy(finder);
		picture_destroy(&picture);
	}
}

static void nothing_is_carried_from_image_to_image(void **state)
{
	struct picture a = random_picture(WIDTH, HEIGHT, WIDTH, 1);
	struct picture b = random_picture(WIDTH, HEIGHT, WIDTH, 2);
	struct grey_image image_a = picture_image(&a), image_b = picture_image(&b);
	struct blob_finder *finder = make_finder(WIDTH, HEIGHT);
	static struct blob_set again;

	(void)state;
	memset(&again, 0, sizeof(again));
	run_once(&image_a);
	blob_finder_run(finder, &image_b, &again);
	memset(&again, 0, sizeof(again));
	blob_finder_run(finder, &image_a, &again);
	assert_true(set.blob_count > 20);
	assert_memory_equal(&set, &again, sizeof(set));
	blob_finder_destroy(finder);
	picture_destroy(&a);
	picture_destroy(&b);
}

static void blobs_come_from_top_to_bottom(void **state)
{
	struct picture picture = random_picture(WIDTH, HEIGHT, WIDTH, 4);
	struct grey_image image = picture_image(&picture);

	(void)state;
	run_once(&image);
	for (uint32_t b = 1; b < set.blob_count; b++)
		assert_true(set.blobs[b].y_px > set.blobs[b - 1].y_px - 12);
	picture_destroy(&picture);
}

static void hot_pixels_and_pairs_are_no_spots(void **state)
{
	static const int hot[][2] = {{20, 20},  {60, 20},  {61, 20},  {100, 20},  {100, 21},
				     {140, 20}, {141, 21}, {180, 63}, {0, 100},   {319, 100},
				     {50, 0},   {51, 239}, {64, 128}, {127, 130}, {128, 130}};

	(void)state;
	find_in_picture(NULL, 0, 15, hot);
	assert_int_equal(set.blob_count, 0);
}

static void the_smallest_faint_spot_is_one(void **state)
{
	struct true_spot spots[16];

	(void)state;
	for (int i = 0; i < 16; i++)
		spots[i] = (struct true_spot){40 + 60 * (i % 4) + i / 16.0,
					      40 + 50 * (i / 4) + i % 5 / 5.0,
					      1,
					      1,
					      0,
					      0.6,
					      40};
	find_in_picture(spots, 16, 0, NULL);
	assert_int_equal(set.blob_count, 16);
}

static void touching_spots_are_parted_and_flagged(void **state)
{
	const struct true_spot spots[] = {
		{60.2, 60.4, 5, 1, 0, 0.8, 120},  {66.6, 61.2, 5, 1, 0, 0.8, 120},
		{160.2, 60.4, 8, 1, 0, 0.8, 150}, {160.9, 70.4, 8, 1, 0, 0.8, 90},
		{100.2, 150.4, 4, 1, 0, 2, 120},  {105.6, 156.4, 4, 1, 0, 2, 120},
	};

	(void)state;
	find_in_picture(spots, 6, 0, NULL);
	assert_int_equal(set.blob_count, 6);
	for (int i = 0; i < 6; i++) {
		const struct blob *blob = blob_near(&set, spots[i].x_px, spots[i].y_px);
		double error;

		assert_non_null(blob);
		error = hypot((double)blob->x_px - spots[i].x_px,
			      (double)blob->y_px - spots[i].y_px);
		assert_true(blob->flags & BLOB_MERGED);
		assert_true(error < 0.25);
		assert_true(error < 5 * (double)blob->sigma_px);
	}
}

static void spots_on_the_border_say_so(void **state)
{
	const struct true_spot spots[] = {
		{-0.5, 60, 6, 1, 0, 0.8, 150},
		{100, 240, 6, 1, 0, 0.8, 150},
		{200, 3, 5, 1, 0, 0.8, 150},
		{160, 120, 6, 1, 0, 0.8, 150},
	};

	(void)state;
	find_in_picture(spots, 4, 0, NULL);
	assert_int_equal(set.blob_count, 4);
	for (uint32_t b = 0; b < 4; b++) {
		bool inside = set.blobs[b].y_px > 100 && set.blobs[b].y_px < 140;
		bool border = set.blobs[b].x_px < 5 || set.blobs[b].y_px > 200;

		if (inside)
			assert_int_equal(set.blobs[b].flags, 0);
		if (border)
			assert_true(set.blobs[b].flags & BLOB_EDGE && set.blobs[b].sigma_px > 0.5f);
	}
}

/* Every row its own offset, every pixel its own, ambient light that rises across the image. */
static void uneven_cameras_show_no_spots_but_the_markers(void **state)
{
	const struct true_spot spots[] = {{60, 60, 4, 1, 0, 0.8, 70},
					  {250, 60, 4, 1, 0, 0.8, 70},
					  {160, 180, 4, 1, 0, 0.8, 70}};
	struct picture picture = picture_create(WIDTH, HEIGHT, 10);
	struct grey_image image = picture_image(&picture);
	struct rng rng;

	(void)state;
	rng_init(&rng, 5, 1);
	for (int i = 0; i < 3; i++)
		picture_add(&picture, &spots[i], 2);
	for (int y = 0; y < HEIGHT; y++) {
		double row = 1.5 * rng_normal(&rng);

		for (int x = 0; x < WIDTH; x++)
			picture.light[y * WIDTH + x] +=
				(float)(row + rng_normal(&rng) + 40.0 * x / WIDTH +
					15.0 * y / HEIGHT);
	}
	picture_expose(&picture, 2, &rng);
	run_once(&image);
	assert_int_equal(set.blob_count, 3);
	for (int i = 0; i < 3; i++)
		assert_non_null(blob_near(&set, spots[i].x_px, spots[i].y_px));
	picture_destroy(&picture);
}

static void lamps_are_no_markers(void **state)
{
	const struct true_spot spots[] = {{160, 120, 60, 1, 0, 1, 150}, {40, 40, 5, 1, 0, 1, 100}};

	(void)state;
	find_in_picture(spots, 2, 0, NULL);
	assert_int_equal(set.blob_count, 1);
}

static void garbage_stays_within_bounds(void **state)
{
	struct picture picture = picture_create(1280, 1024, 0);
	struct grey_image image = picture_image(&picture);
	size_t count = 1280 * 1024;
	struct rng rng;

	(void)state;
	rng_init(&rng, 9, 9);
	for (int kind = 0; kind < 5; kind++) {
		for (size_t i = 0; i < count; i++) {
			uint32_t noise = rng_u32(&rng) & 255;
			uint32_t checker = (i % 1280 / 3 + i / 1280 / 3) % 2 * 255;
			uint32_t values[] = {0, 255, checker, noise,
					     i % 1280 % 5 < 3 && i / 1280 % 5 < 3 ? 200 : 0};

			picture.pixels[i] = (uint8_t)values[kind];
		}
		run_once(&image);
		assert_true(set.blob_count <= BLOB_MAX);
		if (kind < 2)
			assert_int_equal(set.blob_count + set.blobs_lost, 0);
		if (kind == 4) { /* 256 x 205 squares, more than fit anywhere */
			assert_int_equal(set.blob_count, BLOB_MAX);
			assert_true(set.blobs_lost > 1000);
		}
	}
	picture_destroy(&picture);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_scan_finds_what_plain_comparisons_find),
		cmocka_unit_test(both_builds_give_the_same_bits_in_odd_sizes),
		cmocka_unit_test(nothing_is_carried_from_image_to_image),
		cmocka_unit_test(blobs_come_from_top_to_bottom),
		cmocka_unit_test(hot_pixels_and_pairs_are_no_spots),
		cmocka_unit_test(the_smallest_faint_spot_is_one),
		cmocka_unit_test(touching_spots_are_parted_and_flagged),
		cmocka_unit_test(spots_on_the_border_say_so),
		cmocka_unit_test(uneven_cameras_show_no_spots_but_the_markers),
		cmocka_unit_test(lamps_are_no_markers),
		cmocka_unit_test(garbage_stays_within_bounds),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
