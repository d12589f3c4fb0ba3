/*
 * The pure parts of the libcamera driver: which of a camera's formats is taken, how packed rows are
 * unpacked, and that the truth lies within the bound of a time stamp, which is no wider than what
 * is not known.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera_format.h"
#include "drivers/libcamera/libcamera_time.h"

#define BEGIN_NS (1000 * NS_PER_S)
#define PERIOD_NS (8333 * NS_PER_US)
#define EXPOSURE_NS (400 * NS_PER_US)
#define READOUT_NS (5 * NS_PER_MS)
#define FRAMES 24

static const char *chosen(const char *const *names, const struct camera_mode *wanted)
{
	struct libcamera_offers offers = {0};

	for (; *names; names++)
		libcamera_format_add(&offers, true, *names, 640, 480);
	const struct libcamera_offer *offer = libcamera_format_choose(&offers, wanted);

	return offer ? offer->format->name : "none";
}

static void the_best_format_is_taken_whatever_the_order(void **state)
{
	const char *const mono[] = {"NV12", "R10_CSI2P", "R10", "R8", NULL};
	const char *const words[] = {"R10_CSI2P", "R12", "R10", NULL};
	const char *const colour[] = {"R8", "YUYV", "MJPEG", "SRGGB10_CSI2P", "SGBRG8", NULL};
	const char *const processed[] = {"RGB888", "BGR888", "NV12", NULL};
	const char *const useless[] = {"SRGGB10", "XRGB8888", "RGB888", NULL};
	const struct camera_mode grey = {.format = PIXEL_GREY8}, any = {.format = PIXEL_BAYER_RG8},
				 ten = {.format = PIXEL_GREY16, .bits = 10},
				 mjpeg = {.format = PIXEL_MJPEG};

	(void)state;
	assert_string_equal(chosen(mono, &grey), "R8");
	assert_string_equal(chosen(words, &grey), "R12");
	assert_string_equal(chosen(words, &ten), "R10");
	assert_string_equal(chosen(colour, &any), "SGBRG8");
	assert_string_equal(chosen(colour, &mjpeg), "MJPEG");
	assert_string_equal(chosen(processed, &any), "BGR888"); /* R, G, B in memory */
	assert_string_equal(chosen(processed, &grey), "NV12");
	assert_string_equal(chosen(useless, &grey), "none");
	assert_string_equal(chosen(useless, &any), "none");
}

static void packed_words_come_out_as_they_were_packed(void **state)
{
	static const uint8_t ten[] = {0xff, 0x00, 0x80, 0x01, 0xe4, 0x12, 0, 0, 0, 0x03};
	static const uint8_t twelve[] = {0xab, 0xcd, 0xfe, 0x12, 0, 0x03};
	uint16_t words[6] = {0};

	(void)state;
	libcamera_unpack_row(PACKING_10, ten, (uint8_t *)words, 5);
	assert_int_equal(words[0], 0x3fc);
	assert_int_equal(words[1], 0x001);
	assert_int_equal(words[2], 0x202);
	assert_int_equal(words[3], 0x007);
	assert_int_equal(words[4], 0x04b);
	assert_int_equal(words[5], 0); /* behind the row */
	libcamera_unpack_row(PACKING_12, twelve, (uint8_t *)words, 3);
	assert_int_equal(words[0], 0xabe);
	assert_int_equal(words[1], 0xcdf);
	assert_int_equal(words[2], 0x123);
	assert_int_equal(words[3], 0x007);
}

static void colour_keeps_the_upper_bits_and_luma_every_second_byte(void **state)
{
	static const uint8_t row[] = {1, 2, 3, 4, 99, 5, 6, 7, 8, 99};
	uint8_t out[6] = {0};

	(void)state;
	libcamera_unpack_row(PACKING_10_HIGH_8, row, out, 6);
	assert_memory_equal(out, "\1\2\3\4\5\6", 6);
	libcamera_unpack_row(PACKING_LUMA, row, out, 4);
	assert_memory_equal(out, "\1\3\143\6", 4);
}

static void rows_are_as_long_as_their_packing(void **state)
{
	const struct camera_mode any = {.format = PIXEL_BAYER_RG8};
	struct libcamera_offers offers = {0};

	(void)state;
	libcamera_format_add(&offers, true, "SRGGB10_CSI2P", 640, 480);
	const struct libcamera_format *format = libcamera_format_choose(&offers, &any)->format;

	assert_int_equal(libcamera_packed_row_bytes(format, 640), 800);
	assert_int_equal(libcamera_packed_row_bytes(format, 641), 805);
}

enum mark { EXPOSURE_BEGINS, READOUT_BEGINS, FRAME_ENDS, NOTHING };

/* Frames of a camera that stamps `mark`; the bound of the last. */
static int64_t check_truth(struct libcamera_timing timing, enum mark mark, int64_t offset_ns,
			   int64_t rows_ns)
{
	struct libcamera_stamp stamp;
	int64_t last_ns = 0;

	libcamera_time_begin(&timing, BEGIN_NS);
	for (int i = 0; i < FRAMES; i++) {
		int64_t begin_ns = BEGIN_NS + i * PERIOD_NS, read_ns = begin_ns + EXPOSURE_NS;
		int64_t truth_ns = begin_ns + EXPOSURE_NS / 2 + rows_ns / 2;
		int64_t marks_ns[] = {begin_ns, read_ns, read_ns + READOUT_NS};

		stamp = (struct libcamera_stamp){
			.stamp_ns =
				mark == NOTHING ? 0 : marks_ns[mark] + 50 * NS_PER_US + offset_ns,
			.arrival_ns = read_ns + READOUT_NS + (100 + 37 * (i % 5)) * NS_PER_US};
		libcamera_time(&timing, &stamp);
		assert_true(llabs(stamp.mid_exposure_ns - truth_ns) <= stamp.uncertainty_ns);
		assert_true(stamp.mid_exposure_ns <= stamp.arrival_ns);
		assert_true(stamp.mid_exposure_ns > last_ns);
		last_ns = stamp.mid_exposure_ns;
	}
	return stamp.uncertainty_ns;
}

static const struct libcamera_timing all_known = {
	.period_ns = PERIOD_NS, .exposure_ns = EXPOSURE_NS, .readout_ns = READOUT_NS};

static void what_is_known_bounds_the_stamp(void **state)
{
	struct libcamera_timing no_readout = all_known, may_roll = all_known;

	(void)state;
	no_readout.readout_ns = 0;
	may_roll.may_roll = true;
	/* the picture came too soon for the beginning of an exposure to have been stamped */
	assert_in_range(check_truth(all_known, READOUT_BEGINS, 0, 0), 1, 110 * NS_PER_US);
	assert_in_range(check_truth(all_known, FRAME_ENDS, 0, 0), 1, 110 * NS_PER_US);
	/* or not too soon: it may be either, half an exposure off */
	assert_in_range(check_truth(all_known, EXPOSURE_BEGINS, 0, 0), 1, 310 * NS_PER_US);
	assert_in_range(check_truth(no_readout, READOUT_BEGINS, 0, 0), 1, 310 * NS_PER_US);
	assert_in_range(check_truth(no_readout, FRAME_ENDS, 0, 0), 1,
			PERIOD_NS / 2 + 110 * NS_PER_US);
	assert_in_range(check_truth(may_roll, READOUT_BEGINS, 0, 0), 1,
			READOUT_NS / 4 + 110 * NS_PER_US);
	assert_in_range(check_truth(may_roll, READOUT_BEGINS, 0, READOUT_NS), 1,
			READOUT_NS / 4 + 110 * NS_PER_US);
	assert_in_range(check_truth(all_known, NOTHING, 0, 0), 1, 3 * NS_PER_MS);
}

static void rows_of_a_rolling_shutter_move_the_middle(void **state)
{
	struct libcamera_timing rolling = all_known;

	(void)state;
	rolling.rows_ns = READOUT_NS - 100 * NS_PER_US;
	for (int mark = EXPOSURE_BEGINS; mark <= NOTHING; mark++)
		check_truth(rolling, (enum mark)mark, 0, rolling.rows_ns);
	assert_in_range(check_truth(rolling, READOUT_BEGINS, 0, rolling.rows_ns), 1,
			110 * NS_PER_US);
}

static void stamps_of_a_clock_that_ran_while_the_computer_slept_are_taken(void **state)
{
	struct libcamera_timing slept = all_known;

	(void)state;
	slept.boot_offset_ns = 5 * 3600 * NS_PER_S;
	assert_in_range(check_truth(slept, READOUT_BEGINS, slept.boot_offset_ns, 0), 1,
			110 * NS_PER_US);
	/* of another clock altogether: as good as none */
	assert_in_range(check_truth(all_known, READOUT_BEGINS, 1700000000 * NS_PER_S, 0),
			110 * NS_PER_US, 3 * NS_PER_MS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_best_format_is_taken_whatever_the_order),
		cmocka_unit_test(packed_words_come_out_as_they_were_packed),
		cmocka_unit_test(colour_keeps_the_upper_bits_and_luma_every_second_byte),
		cmocka_unit_test(rows_are_as_long_as_their_packing),
		cmocka_unit_test(what_is_known_bounds_the_stamp),
		cmocka_unit_test(rows_of_a_rolling_shutter_move_the_middle),
		cmocka_unit_test(stamps_of_a_clock_that_ran_while_the_computer_slept_are_taken),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("drivers_libcamera", tests, NULL, NULL);
}
