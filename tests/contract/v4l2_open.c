/*
 * Which V4L2 camera is opened and in what mode, on fake ones; and what is said when it cannot be.
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

static void a_serial_number_of_two_devices_is_refused_and_a_name_decides(void **state)
{
	(void)state;
	fake_v4l2_plug(0, "A1", "card Colour");
	fake_v4l2_plug(2, "A1", "card Infrared");
	assert_int_equal(open_and_configure("serial=A1", &grey), -EINVAL);
	assert_told("/dev/video0 (Colour", "/dev/video2 (Infrared", NULL);
	assert_int_equal(open_and_configure("serial=A1,card=Infrared", &grey), 0);
	close_camera();
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

static void a_format_that_is_not_there_is_refused_with_those_that_are(void **state)
{
	static const struct camera_mode raw = {.format = PIXEL_GREY16, .bits = 12};

	(void)state;
	fake_v4l2_plug(0, "A1", "formats MJPG,Y10");
	assert_int_equal(open_and_configure("/dev/video0", &raw), -ENOTSUP);
	assert_told("/dev/video0", "grey16", "MJPG, Y10", NULL);
	close_camera();
	fake_v4l2_plug(1, "B2", "formats MJPG");
	assert_int_equal(open_and_configure("/dev/video1", &grey), -ENOTSUP);
	assert_told("/dev/video1", "grey is wanted", "offers MJPG", NULL);
}

static void pictures_in_several_memory_planes_are_refused_by_name(void **state)
{
	(void)state;
	fake_v4l2_plug(0, "A1", "planes 2");
	assert_int_equal(open_and_configure("/dev/video0", &grey), -ENOTSUP);
	assert_told("/dev/video0", "GREY lie in 2 memory planes", "another format", NULL);
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
	release(&frame);
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
		close_camera();
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

int main(void)
{
	const struct CMUnitTest tests[] = {
		V4L2_TEST(a_serial_number_of_two_devices_is_refused_and_a_name_decides),
		V4L2_TEST(cameras_are_listed_by_serial_number_where_it_is_their_own),
		V4L2_TEST(what_cannot_be_opened_is_named_with_the_remedy),
		V4L2_TEST(a_kernel_without_v4l2_is_named),
		V4L2_TEST(a_device_that_another_program_streams_from_is_busy),
		V4L2_TEST(a_format_that_is_not_there_is_refused_with_those_that_are),
		V4L2_TEST(pictures_in_several_memory_planes_are_refused_by_name),
		V4L2_TEST(grey_of_more_bits_is_taken_before_the_luma_of_yuyv),
		V4L2_TEST(the_rate_granted_is_what_the_device_will_do),
		V4L2_TEST(a_size_that_is_not_there_is_refused_with_those_that_are),
		V4L2_TEST(the_largest_size_that_keeps_the_rate_is_taken),
		V4L2_TEST(an_exposure_is_set_in_the_cameras_units_and_told),
		V4L2_TEST(decibels_are_refused_with_the_control_to_use),
		V4L2_TEST(controls_are_set_by_name),
		V4L2_TEST(a_control_that_is_not_there_is_refused_with_those_that_are),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
