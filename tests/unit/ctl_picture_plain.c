/*
 * Pictures made plain for people: what a camera meant is what they see.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jpeglib.h>

#include "ctl/camera/picture_plain.h"

#define WIDTH 32
#define HEIGHT 24

static uint8_t *plain;
static enum pixel_format format;

static int forget(void **state)
{
	(void)state;
	free(plain);
	plain = NULL;
	return 0;
}

static struct frame frame_of(const void *pixels, enum pixel_format packed, int stride_bytes)
{
	return (struct frame){.pixels = pixels,
			      .width_px = WIDTH,
			      .height_px = HEIGHT,
			      .stride_bytes = stride_bytes,
			      .format = packed};
}

static void words_of_grey_lose_their_lowest_bits(void **state)
{
	static uint8_t rows[HEIGHT][2 * WIDTH + 6];
	struct frame frame = frame_of(rows, PIXEL_GREY16, sizeof(rows[0]));

	(void)state;
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++) {
			int word = 37 * x + y;

			rows[y][2 * x] = (uint8_t)word;
			rows[y][2 * x + 1] = (uint8_t)(word >> 8);
		}
	frame.bits = 12;
	assert_int_equal(picture_make_plain(&frame, &plain, &format), 0);
	assert_int_equal(format, PIXEL_GREY8);
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		assert_int_equal(plain[i], (37 * (i % WIDTH) + i / WIDTH) >> 4);
}

static void assert_colour(const uint8_t *rgb, int red, int green, int blue, int off)
{
	assert_in_range(rgb[0] + off, red, red + 2 * off);
	assert_in_range(rgb[1] + off, green, green + 2 * off);
	assert_in_range(rgb[2] + off, blue, blue + 2 * off);
}

/* The colour bars of ITU-R BT.601. */
static void yuyv_becomes_the_colours_meant(void **state)
{
	static const struct {
		uint8_t y, u, v, rgb[3];
	} bars[] = {{235, 128, 128, {255, 255, 255}},
		    {16, 128, 128, {0, 0, 0}},
		    {81, 90, 240, {255, 0, 0}},
		    {145, 54, 34, {0, 255, 0}},
		    {41, 240, 110, {0, 0, 255}}};
	static uint8_t pixels[HEIGHT * WIDTH * 2];

	for (size_t b = 0; b < sizeof(bars) / sizeof(bars[0]); b++) {
		struct frame frame = frame_of(pixels, PIXEL_YUYV, 2 * WIDTH);

		for (int i = 0; i < HEIGHT * WIDTH; i++) {
			pixels[2 * i] = bars[b].y;
			pixels[2 * i + 1] = i % 2 ? bars[b].v : bars[b].u;
		}
		assert_int_equal(picture_make_plain(&frame, &plain, &format), 0);
		assert_int_equal(format, PIXEL_RGB8);
		for (int i = 0; i < WIDTH * HEIGHT; i++)
			assert_colour(plain + 3 * i, bars[b].rgb[0], bars[b].rgb[1], bars[b].rgb[2],
				      2);
		forget(state);
	}
}

static void mosaics_of_every_order_become_the_colours_meant(void **state)
{
	static const struct {
		enum pixel_format order;
		const char *pattern; /* top-left four */
	} orders[] = {
		{PIXEL_BAYER_GR8, "GRBG"}, {PIXEL_BAYER_GB8, "GBRG"}, {PIXEL_BAYER_BG8, "BGGR"}};
	static uint8_t rows[HEIGHT][WIDTH + 5];

	for (size_t o = 0; o < 3; o++) {
		struct frame frame = frame_of(rows, orders[o].order, sizeof(rows[0]));

		for (int y = 0; y < HEIGHT; y++)
			for (int x = 0; x < WIDTH; x++) {
				char colour = orders[o].pattern[2 * (y % 2) + x % 2];

				rows[y][x] = colour == 'R' ? 200 : colour == 'G' ? 90 : 30;
			}
		assert_int_equal(picture_make_plain(&frame, &plain, &format), 0);
		assert_int_equal(format, PIXEL_RGB8);
		for (int i = 0; i < WIDTH * HEIGHT; i++)
			assert_colour(plain + 3 * i, 200, 90, 30, 0);
		forget(state);
	}
}

/* Of one colour; the caller frees it. */
static uint8_t *make_jpeg(unsigned long *size_bytes)
{
	struct jpeg_error_mgr errors;
	struct jpeg_compress_struct encoder = {.err = jpeg_std_error(&errors)};
	uint8_t row[3 * WIDTH], *jpeg = NULL;
	JSAMPROW rows[] = {row};

	for (int i = 0; i < 3 * WIDTH; i++)
		row[i] = (uint8_t[]){220, 120, 40}[i % 3];
	jpeg_create_compress(&encoder);
	jpeg_mem_dest(&encoder, &jpeg, size_bytes);
	encoder.image_width = WIDTH;
	encoder.image_height = HEIGHT;
	encoder.input_components = 3;
	encoder.in_color_space = JCS_RGB;
	jpeg_set_defaults(&encoder);
	jpeg_start_compress(&encoder, TRUE);
	for (int y = 0; y < HEIGHT; y++)
		jpeg_write_scanlines(&encoder, rows, 1);
	jpeg_finish_compress(&encoder);
	jpeg_destroy_compress(&encoder);
	return jpeg;
}

static void a_jpeg_is_decoded_and_a_damaged_one_refused(void **state)
{
	unsigned long size_bytes = 0;
	uint8_t *jpeg = make_jpeg(&size_bytes);
	struct frame frame = frame_of(jpeg, PIXEL_MJPEG, 0);

	(void)state;
	frame.size_bytes = size_bytes;
	assert_int_equal(picture_make_plain(&frame, &plain, &format), 0);
	assert_int_equal(format, PIXEL_RGB8);
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		assert_colour(plain + 3 * i, 220, 120, 40, 4);
	frame.width_px = WIDTH / 2;
	assert_int_equal(picture_make_plain(&frame, &plain, &format), -EBADMSG);
	frame.width_px = WIDTH;
	frame.size_bytes = 40;
	assert_int_equal(picture_make_plain(&frame, &plain, &format), -EBADMSG);
	free(jpeg);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_teardown(words_of_grey_lose_their_lowest_bits, forget),
		cmocka_unit_test_teardown(yuyv_becomes_the_colours_meant, forget),
		cmocka_unit_test_teardown(mosaics_of_every_order_become_the_colours_meant, forget),
		cmocka_unit_test_teardown(a_jpeg_is_decoded_and_a_damaged_one_refused, forget),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
