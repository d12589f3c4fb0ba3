/*
 * What can go wrong with a V4L2 camera that runs, on fake ones: what the driver says and counts.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "tests/contract/v4l2_camera.h"

static void a_pulled_plug_is_told_by_the_dequeue(void **state)
{
	struct frame frame;
	int error;

	(void)state;
	begin("", &grey);
	take(&frame);
	release(&frame);
	fake_v4l2_unplug(0);
	while ((error = next(&frame)) == 0)
		release(&frame);
	assert_int_equal(error, -ENODEV);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
	driver->stop(camera);
}

static void a_pulled_plug_is_told_by_the_queue(void **state)
{
	struct frame frame;

	(void)state;
	begin("quiet 1", &grey);
	take(&frame);
	fake_v4l2_unplug(0);
	clock_sleep_until(clock_now_ns() + 50 * NS_PER_MS);
	release(&frame);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
}

static void a_camera_plugged_in_elsewhere_opens_by_its_serial_number(void **state)
{
	struct frame frame;

	(void)state;
	fake_v4l2_plug(0, "A1", "");
	fake_v4l2_plug(1, "B2", "card Other");
	assert_int_equal(open_and_configure("serial=A1", &grey), 0);
	fake_v4l2_unplug(0);
	close_camera();
	assert_int_equal(open_and_configure("serial=A1", &grey), -ENODEV);
	assert_told("serial=A1", "no such device", "/dev/video1 (Other, serial B2)", NULL);
	fake_v4l2_plug(7, "A1", "");
	assert_int_equal(open_and_configure("serial=A1", &grey), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	take(&frame);
	release(&frame);
	driver->stop(camera);
}

static void a_device_that_fails_is_lost_and_starts_anew(void **state)
{
	struct frame frame;
	int error;

	(void)state;
	begin("eio_after 3", &grey);
	while ((error = next(&frame)) == 0)
		release(&frame);
	assert_int_equal(error, -EIO);
	driver->stop(camera);
	assert_int_equal(driver->start(camera, &diag), 0);
	take(&frame);
	release(&frame);
	driver->stop(camera);
}

static int64_t truth_ns(const struct frame *frame)
{
	int64_t mid_exposure_ns;

	memcpy(&mid_exposure_ns, frame->pixels, sizeof(mid_exposure_ns));
	return mid_exposure_ns;
}

static void lost_frames_leave_their_gap(void **state)
{
	struct frame frame;
	uint64_t last = 0;
	int gaps = 0;

	(void)state;
	begin("gap_every 5", &grey);
	for (int i = 0; i < 20; i++) {
		take(&frame);
		gaps += i > 0 && frame.device_seq == last + 2;
		assert_true(i == 0 || frame.device_seq > last);
		last = frame.device_seq;
		release(&frame);
	}
	assert_in_range(gaps, 2, 6); /* 3 or 4, unless this machine stood still meanwhile */
}

static void a_stall_beyond_the_buffers_leaves_its_gap(void **state)
{
	struct frame frame;
	uint64_t first;

	(void)state;
	begin("period_us 4000\nreadout_us 1000", &grey);
	take(&frame);
	first = frame.device_seq;
	clock_sleep_until(clock_now_ns() + 600 * NS_PER_MS);
	release(&frame);
	for (int i = 0; i < 40; i++) {
		take(&frame);
		release(&frame);
	}
	assert_true(frame.device_seq > first + 100);
}

static void frames_of_a_device_that_does_not_count_are_counted(void **state)
{
	struct frame frame;

	(void)state;
	begin("still 1", &grey);
	for (uint64_t i = 0; i < 5; i++) {
		take(&frame);
		assert_int_equal(frame.device_seq, i);
		release(&frame);
	}
}

static void damaged_frames_are_dropped_and_counted(void **state)
{
	struct frame frame;
	int damaged = 0, good = 0;

	(void)state;
	begin("error_every 4\nshort_every 3", &grey);
	while (good < 10) {
		int error = next(&frame);

		damaged += error == -EBADMSG;
		good += error == 0;
		assert_true(error == 0 || error == -EBADMSG);
		if (!error)
			release(&frame);
	}
	assert_in_range(damaged, 4, 16); /* half of them, as long as none is lost */
}

/* Each buffer is lent at its own address, which comes back when its turn does. */
static void pixels_are_read_where_the_kernel_put_them(void **state)
{
	static const char *const settings[] = {"formats GREY\nstride 179", "formats Y10",
					       "formats Y12", "formats RGGB",
					       "planes 1\noffset 128"};
	static const enum pixel_format formats[] = {PIXEL_GREY8, PIXEL_GREY16, PIXEL_GREY16,
						    PIXEL_BAYER_RG8, PIXEL_GREY8};

	for (size_t f = 0; f < sizeof(formats) / sizeof(formats[0]); f++) {
		struct camera_mode wanted = {.format = formats[f], .period_ns = 4 * NS_PER_MS};
		const uint8_t *at[64];
		struct frame frame;
		int same = 0;

		begin(settings[f], &wanted);
		for (int i = 0; i < 64; i++) {
			take(&frame);
			at[i] = frame.pixels;
			for (int j = 0; j < i; j++)
				same += at[j] == at[i];
			release(&frame);
		}
		assert_true(at[0] != at[1]);
		assert_true(same >= 32); /* of 64 frames in at most 32 buffers */
		v4l2_tear_down(state);
		v4l2_set_up(state);
	}
}

static void luma_is_taken_out_of_yuyv(void **state)
{
	struct frame frame;
	int bright = 0, dark = 0;

	(void)state;
	begin("formats YUYV\nstride 336", &grey);
	assert_int_equal(granted.format, PIXEL_GREY8);
	take(&frame);
	for (int y = 1; y < frame.height_px; y++)
		for (int x = 0; x < frame.width_px; x++) {
			int value = frame.pixels[y * frame.stride_bytes + x];

			bright += value == 200;
			dark += value == 12;
		}
	assert_int_equal(bright, FAKE_V4L2_SPOT_PX * FAKE_V4L2_SPOT_PX);
	assert_int_equal(bright + dark, (frame.height_px - 1) * frame.width_px);
	release(&frame);
}

static void the_true_time_lies_within_the_bound(void **state)
{
	static const struct {
		const char *settings;
		int64_t readout_ns, bound_ns;
	} cases[] = {
		{"stamps soe", 0, 110 * NS_PER_US},
		{"stamps eof", 4 * NS_PER_MS, 110 * NS_PER_US},
		{"stamps eof", 0, 5200 * NS_PER_US},
		{"stamps soe\nperiod_us 20000", 0, 110 * NS_PER_US},
	};

	for (size_t c = 0; c < sizeof(cases) / sizeof(cases[0]); c++) {
		struct camera_mode wanted = {.exposure_ns = NS_PER_MS,
					     .readout_ns = cases[c].readout_ns,
					     .shutter = SHUTTER_GLOBAL};
		struct frame frame;

		begin(cases[c].settings, &wanted);
		for (int i = 0; i < 10; i++) {
			take(&frame);
			assert_true(llabs(frame.mid_exposure_ns - truth_ns(&frame)) <=
				    frame.uncertainty_ns);
			assert_true(frame.uncertainty_ns <= cases[c].bound_ns);
			release(&frame);
		}
		v4l2_tear_down(state);
		v4l2_set_up(state);
	}
}

/* The truth of these cameras is that of their first row. */
static void a_rolling_shutter_is_stamped_in_its_middle_row_and_doubt_widens_the_bound(void **state)
{
	static const struct {
		const char *settings;
		enum camera_shutter shutter;
		int64_t row_time_ns, readout_ns, granted_ns, bound_ns;
	} cases[] = {
		{"", SHUTTER_ROLLING, 30000, 0, 30000, 110 * NS_PER_US},
		{"", SHUTTER_ROLLING, 0, 3600000, 30000, 110 * NS_PER_US},
		{"hblank 40\npixel_rate 8000000", SHUTTER_ROLLING, 0, 0, 25000, 110 * NS_PER_US},
		{"", SHUTTER_UNKNOWN, 0, 3600000, 0, 1910 * NS_PER_US},
	};

	for (size_t c = 0; c < sizeof(cases) / sizeof(cases[0]); c++) {
		struct camera_mode wanted = {.exposure_ns = NS_PER_MS,
					     .shutter = cases[c].shutter,
					     .row_time_ns = cases[c].row_time_ns,
					     .readout_ns = cases[c].readout_ns};
		struct frame frame;

		begin(cases[c].settings, &wanted);
		assert_int_equal(granted.row_time_ns, cases[c].granted_ns);
		take(&frame);
		assert_int_equal(frame.row_time_ns, cases[c].granted_ns);
		int64_t middle_ns = truth_ns(&frame) + cases[c].granted_ns * 119 / 2;

		assert_true(llabs(frame.mid_exposure_ns - middle_ns) <= frame.uncertainty_ns);
		assert_in_range(frame.uncertainty_ns, cases[c].bound_ns * 9 / 10,
				cases[c].bound_ns);
		release(&frame);
		v4l2_tear_down(state);
		v4l2_set_up(state);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		V4L2_TEST(a_pulled_plug_is_told_by_the_dequeue),
		V4L2_TEST(a_pulled_plug_is_told_by_the_queue),
		V4L2_TEST(a_camera_plugged_in_elsewhere_opens_by_its_serial_number),
		V4L2_TEST(a_device_that_fails_is_lost_and_starts_anew),
		V4L2_TEST(lost_frames_leave_their_gap),
		V4L2_TEST(a_stall_beyond_the_buffers_leaves_its_gap),
		V4L2_TEST(frames_of_a_device_that_does_not_count_are_counted),
		V4L2_TEST(damaged_frames_are_dropped_and_counted),
		V4L2_TEST(pixels_are_read_where_the_kernel_put_them),
		V4L2_TEST(luma_is_taken_out_of_yuyv),
		V4L2_TEST(the_true_time_lies_within_the_bound),
		V4L2_TEST(
			a_rolling_shutter_is_stamped_in_its_middle_row_and_doubt_widens_the_bound),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
