/*
 * What can go wrong with a V4L2 camera, on fake ones: what the driver says, counts and keeps to.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/v4l2.h"
#include "tests/contract/fake_v4l2.h"

#define PATIENCE_NS (5 * NS_PER_S)

static const struct camera_driver *const driver = &v4l2_camera_driver;
static struct camera *camera;
static struct camera_mode granted;
static struct diag diag;

static int set_up(void **state)
{
	(void)state;
	fake_v4l2_begin();
	camera = NULL;
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	driver->close(camera);
	diag_finish(&diag);
	fake_v4l2_end();
	return 0;
}

static void forget_messages(void)
{
	diag_finish(&diag);
}

/* One message that has each of the words, which end with NULL. */
static void assert_told(const char *first, ...)
{
	va_list words;

	assert_int_equal(diag.count, 1);
	va_start(words, first);
	for (const char *word = first; word; word = va_arg(words, const char *))
		if (!strstr(diag.text, word))
			fail_msg("'%s' is not in: %s", word, diag.text);
	va_end(words);
	forget_messages();
}

static int open_and_configure(const char *rest, const struct camera_mode *wanted)
{
	int error = driver->open(&camera, rest, NULL, &diag);

	return error ? error : driver->configure(camera, wanted, &granted, &diag);
}

static void begin(const char *settings, const struct camera_mode *wanted)
{
	fake_v4l2_plug(0, "A1", settings);
	int error = open_and_configure("/dev/video0", wanted);

	if (!error)
		error = driver->start(camera, &diag);
	if (error)
		fail_msg("%s", diag.text);
}

static const struct camera_mode grey = {.format = PIXEL_GREY8};

/* The driver's next answer but for -ETIMEDOUT. */
static int next(struct frame *frame)
{
	int64_t deadline_ns = clock_now_ns() + PATIENCE_NS;
	int error;

	do
		error = driver->acquire(camera, 50 * NS_PER_MS, frame);
	while (error == -ETIMEDOUT && clock_now_ns() < deadline_ns);
	return error;
}

static void take(struct frame *frame)
{
	assert_int_equal(next(frame), 0);
}

static int64_t truth_ns(const struct frame *frame)
{
	int64_t mid_exposure_ns;

	memcpy(&mid_exposure_ns, frame->pixels, sizeof(mid_exposure_ns));
	return mid_exposure_ns;
}

/* Unplugging ----------------------------------------------------------------------------------- */

static void a_pulled_plug_is_told_by_the_dequeue(void **state)
{
	struct frame frame;
	int error;

	(void)state;
	begin("", &grey);
	take(&frame);
	driver->release(camera, &frame);
	fake_v4l2_unplug(0);
	while ((error = next(&frame)) == 0)
		driver->release(camera, &frame);
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
	driver->release(camera, &frame);
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
	driver->close(camera);
	camera = NULL;
	assert_int_equal(open_and_configure("serial=A1", &grey), -ENODEV);
	assert_told("serial=A1", "no such device", "/dev/video1 (Other, serial B2)", NULL);
	fake_v4l2_plug(7, "A1", "");
	assert_int_equal(open_and_configure("serial=A1", &grey), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	take(&frame);
	driver->release(camera, &frame);
	driver->stop(camera);
}

static void a_device_that_fails_is_lost_and_starts_anew(void **state)
{
	struct frame frame;
	int error;

	(void)state;
	begin("eio_after 3", &grey);
	while ((error = next(&frame)) == 0)
		driver->release(camera, &frame);
	assert_int_equal(error, -EIO);
	driver->stop(camera);
	assert_int_equal(driver->start(camera, &diag), 0);
	take(&frame);
	driver->release(camera, &frame);
	driver->stop(camera);
}

/* Which device --------------------------------------------------------------------------------- */

static void a_serial_number_of_two_devices_is_refused_and_a_name_decides(void **state)
{
	(void)state;
	fake_v4l2_plug(0, "A1", "card Colour");
	fake_v4l2_plug(2, "A1", "card Infrared");
	assert_int_equal(open_and_configure("serial=A1", &grey), -EINVAL);
	assert_told("/dev/video0 (Colour", "/dev/video2 (Infrared", NULL);
	assert_int_equal(open_and_configure("serial=A1,card=Infrared", &grey), 0);
	driver->close(camera);
	camera = NULL;
	assert_int_equal(open_and_configure("card=Colour", &grey), 0);
}

struct found {
	int count;
	struct camera_info infos[4];
};

static void keep(const struct camera_info *info, void *user)
{
	struct found *found = user;

	assert_true(found->count < 4);
	found->infos[found->count++] = *info;
}

static void cameras_are_listed_by_serial_number_where_it_is_their_own(void **state)
{
	struct found found = {0};

	(void)state;
	fake_v4l2_plug(0, "A1", "card Left");
	fake_v4l2_plug(1, "A1", "metadata 1");
	fake_v4l2_plug(2, NULL, "card Nameless");
	fake_v4l2_plug(10, "B2", "denied 1");
	assert_int_equal(driver->list(keep, &found, &diag), 0);
	assert_int_equal(found.count, 3);
	assert_string_equal(found.infos[0].address, "v4l2:serial=A1");
	assert_string_equal(found.infos[0].model, "Left (video0)");
	assert_string_equal(found.infos[1].address, "v4l2:/dev/video2");
	assert_non_null(strstr(found.infos[2].model, "permission denied"));
}

static void what_cannot_be_opened_is_named_with_the_remedy(void **state)
{
	(void)state;
	fake_v4l2_plug(0, "A1", "denied 1");
	fake_v4l2_plug(1, "A1", "metadata 1");
	fake_v4l2_plug(2, "C3", "cannot_stream 1");
	assert_int_equal(open_and_configure("/dev/video0", &grey), -EACCES);
	assert_told("/dev/video0", "Permission denied", "group", NULL);
	assert_int_equal(open_and_configure("/dev/video1", &grey), -ENOTSUP);
	assert_told("/dev/video1", "not a camera", "camera list", NULL);
	assert_int_equal(open_and_configure("/dev/video2", &grey), -ENOTSUP);
	assert_told("/dev/video2", "cannot stream", NULL);
	assert_int_equal(open_and_configure("/dev/video9", &grey), -ENODEV);
	assert_told("/dev/video9", "no such device", "/dev/video2 (Fake camera, serial C3)", NULL);
}

static void a_kernel_without_v4l2_is_named(void **state)
{
	(void)state;
	setenv("FAKE_V4L2", "/nonexistent", 1);
	assert_int_equal(open_and_configure("/dev/video0", &grey), -ENODEV);
	assert_told("/dev/video0", "runs without V4L2", NULL);
	assert_int_equal(open_and_configure("serial=A1", &grey), -ENODEV);
	assert_told("serial=A1", "runs without V4L2", NULL);
}

static void a_device_that_another_program_streams_from_is_busy(void **state)
{
	struct camera *other = NULL;

	(void)state;
	begin("", &grey);
	assert_int_equal(driver->open(&other, "/dev/video0", NULL, &diag), 0);
	assert_int_equal(driver->configure(other, &grey, &granted, &diag), -EBUSY);
	assert_told("/dev/video0", "busy", "another program", NULL);
	driver->close(other);
}

/* Modes ---------------------------------------------------------------------------------------- */

static void a_format_that_is_not_there_is_refused_with_those_that_are(void **state)
{
	static const struct camera_mode raw = {.format = PIXEL_GREY16, .bits = 12};

	(void)state;
	fake_v4l2_plug(0, "A1", "formats MJPG,Y10");
	assert_int_equal(open_and_configure("/dev/video0", &raw), -ENOTSUP);
	assert_told("/dev/video0", "grey16", "MJPG, Y10", NULL);
	driver->close(camera);
	camera = NULL;
	fake_v4l2_plug(1, "B2", "formats MJPG");
	assert_int_equal(open_and_configure("/dev/video1", &grey), -ENOTSUP);
	assert_told("/dev/video1", "grey is wanted", "offers MJPG", NULL);
}

static void grey_of_more_bits_is_taken_before_the_luma_of_yuyv(void **state)
{
	struct frame frame;
	uint16_t first;

	(void)state;
	begin("formats YUYV,Y10,Y12", &grey);
	assert_int_equal(granted.format, PIXEL_GREY16);
	assert_int_equal(granted.bits, 12);
	take(&frame);
	memcpy(&first, frame.pixels + 2 * 20, sizeof(first));
	assert_int_equal(first, 12 << 4);
	driver->release(camera, &frame);
}

static void the_rate_granted_is_what_the_device_will_do(void **state)
{
	static const struct camera_mode fast = {.period_ns = 8333333};

	(void)state;
	begin("", &fast);
	assert_int_equal(granted.period_ns, 9 * NS_PER_MS);
}

static void a_size_that_is_not_there_is_refused_with_those_that_are(void **state)
{
	static const struct camera_mode small = {.width_px = 32, .height_px = 32};

	(void)state;
	fake_v4l2_plug(0, "A1", "");
	assert_int_equal(open_and_configure("/dev/video0", &small), -EINVAL);
	assert_told("/dev/video0", "32x32", "80x60, 160x120", NULL);
}

static void the_largest_size_that_keeps_the_rate_is_taken(void **state)
{
	static const struct camera_mode modes[] = {
		{.period_ns = 0}, {.period_ns = 5 * NS_PER_MS}, {.period_ns = 4 * NS_PER_MS}};
	static const int widths_px[] = {160, 160, 80};

	(void)state;
	fake_v4l2_plug(0, "A1", "");
	for (size_t i = 0; i < 3; i++) {
		assert_int_equal(open_and_configure("/dev/video0", &modes[i]), 0);
		assert_int_equal(granted.width_px, widths_px[i]);
		driver->close(camera);
		camera = NULL;
	}
}

static void an_exposure_is_set_in_the_cameras_units_and_told(void **state)
{
	static const struct camera_mode lit = {.exposure_ns = 730 * NS_PER_US};

	(void)state;
	begin("", &lit);
	assert_int_equal(granted.exposure_ns, 700 * NS_PER_US);
}

static void decibels_are_refused_with_the_control_to_use(void **state)
{
	static const struct camera_mode loud = {.gain_db = 6};

	(void)state;
	fake_v4l2_plug(0, "A1", "");
	assert_int_equal(open_and_configure("/dev/video0", &loud), -ENOTSUP);
	assert_told("/dev/video0", "controls: {gain: N}", "0 to 255", NULL);
}

static void controls_are_set_by_name(void **state)
{
	static const struct camera_mode wanted = {.control_count = 3,
						  .controls = {{"auto_exposure", 1},
							       {"exposure_time_absolute", 50},
							       {"trigger_mode", 1}}};

	(void)state;
	begin("", &wanted);
	assert_int_equal(granted.exposure_ns, 5 * NS_PER_MS);
	assert_int_equal(granted.control_count, 3);
	assert_int_equal(granted.controls[2].value, 1);
}

static void a_control_that_is_not_there_is_refused_with_those_that_are(void **state)
{
	static const struct camera_mode unknown = {.control_count = 1,
						   .controls = {{"privacy", 1}}};
	static const struct camera_mode wide = {.control_count = 1, .controls = {{"gain", 256}}};

	(void)state;
	fake_v4l2_plug(0, "A1", "");
	assert_int_equal(open_and_configure("/dev/video0", &unknown), -EINVAL);
	assert_told("/dev/video0", "no privacy",
		    "it has gain, auto_exposure, exposure_time_absolute, trigger_mode", NULL);
	assert_int_equal(driver->configure(camera, &wide, &granted, &diag), -EINVAL);
	assert_told("gain: 256 is outside 0 to 255", NULL);
}

/* Frames --------------------------------------------------------------------------------------- */

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
		driver->release(camera, &frame);
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
	driver->release(camera, &frame);
	for (int i = 0; i < 40; i++) {
		take(&frame);
		driver->release(camera, &frame);
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
		driver->release(camera, &frame);
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
			driver->release(camera, &frame);
	}
	assert_in_range(damaged, 4, 16); /* half of them, as long as none is lost */
}

/* Each buffer is lent at its own address, which comes back when its turn does. */
static void pixels_are_read_where_the_kernel_put_them(void **state)
{
	static const char *const settings[] = {"formats GREY\nstride 179", "formats Y10",
					       "formats Y12", "formats RGGB"};
	static const enum pixel_format formats[] = {PIXEL_GREY8, PIXEL_GREY16, PIXEL_GREY16,
						    PIXEL_BAYER_RG8};

	for (size_t f = 0; f < 4; f++) {
		struct camera_mode wanted = {.format = formats[f]};
		const uint8_t *at[64];
		struct frame frame;
		int same = 0;

		begin(settings[f], &wanted);
		for (int i = 0; i < 64; i++) {
			take(&frame);
			at[i] = frame.pixels;
			for (int j = 0; j < i; j++)
				same += at[j] == at[i];
			driver->release(camera, &frame);
		}
		assert_true(at[0] != at[1]);
		assert_true(same >= 32); /* of 64 frames in at most 32 buffers */
		tear_down(state);
		set_up(state);
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
	driver->release(camera, &frame);
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
					     .readout_ns = cases[c].readout_ns};
		struct frame frame;

		begin(cases[c].settings, &wanted);
		for (int i = 0; i < 10; i++) {
			take(&frame);
			assert_true(llabs(frame.mid_exposure_ns - truth_ns(&frame)) <=
				    frame.uncertainty_ns);
			assert_true(frame.uncertainty_ns <= cases[c].bound_ns);
			driver->release(camera, &frame);
		}
		tear_down(state);
		set_up(state);
	}
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_pulled_plug_is_told_by_the_dequeue),
		TEST(a_pulled_plug_is_told_by_the_queue),
		TEST(a_camera_plugged_in_elsewhere_opens_by_its_serial_number),
		TEST(a_device_that_fails_is_lost_and_starts_anew),
		TEST(a_serial_number_of_two_devices_is_refused_and_a_name_decides),
		TEST(cameras_are_listed_by_serial_number_where_it_is_their_own),
		TEST(what_cannot_be_opened_is_named_with_the_remedy),
		TEST(a_kernel_without_v4l2_is_named),
		TEST(a_device_that_another_program_streams_from_is_busy),
		TEST(a_format_that_is_not_there_is_refused_with_those_that_are),
		TEST(grey_of_more_bits_is_taken_before_the_luma_of_yuyv),
		TEST(the_rate_granted_is_what_the_device_will_do),
		TEST(a_size_that_is_not_there_is_refused_with_those_that_are),
		TEST(the_largest_size_that_keeps_the_rate_is_taken),
		TEST(an_exposure_is_set_in_the_cameras_units_and_told),
		TEST(decibels_are_refused_with_the_control_to_use),
		TEST(controls_are_set_by_name),
		TEST(a_control_that_is_not_there_is_refused_with_those_that_are),
		TEST(lost_frames_leave_their_gap),
		TEST(a_stall_beyond_the_buffers_leaves_its_gap),
		TEST(frames_of_a_device_that_does_not_count_are_counted),
		TEST(damaged_frames_are_dropped_and_counted),
		TEST(pixels_are_read_where_the_kernel_put_them),
		TEST(luma_is_taken_out_of_yuyv),
		TEST(the_true_time_lies_within_the_bound),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
