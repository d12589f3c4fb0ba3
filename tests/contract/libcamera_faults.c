/*
 * The libcamera driver on a camera without libcamera: what it asks of a camera, refuses, lends,
 * counts and says. Run under the guard of tests/rt too: the capture thread's calls are in a
 * section.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera.h"
#include "tests/contract/fake_libcamera.h"
#include "tests/contract/one_camera.h"

const struct camera_driver *const driver = &libcamera_camera_driver;
static const struct camera_mode grey = {.format = PIXEL_GREY8};

static int set_up(void **state)
{
	(void)state;
	fake_libcamera_begin();
	return 0;
}

static int configure(const struct camera_mode *wanted)
{
	return open_and_configure(FAKE_ID, wanted);
}

static void begin(const struct camera_mode *wanted)
{
	start_camera(FAKE_ID, wanted);
}

static void frames_are_lent_in_the_cameras_own_memory(void **state)
{
	struct frame frame;

	(void)state;
	begin(&grey);
	for (int i = 0; i < 20; i++) {
		take(&frame);
		uint8_t *there = fake_libcamera_pixels((uint32_t)(uintptr_t)frame.token);

		assert_int_equal(frame.pixels[81], (uint8_t)(frame.device_seq + 2));
		there[81] ^= 0xff; /* what is written there is seen here: it is no copy */
		assert_int_equal(frame.pixels[81], (uint8_t) ~(frame.device_seq + 2));
		assert_int_equal(frame.stride_bytes, 80);
		release(&frame);
	}
}

static void words_packed_as_on_the_bus_are_unpacked(void **state)
{
	struct frame frame;

	(void)state;
	fake.formats[0] = "R10_CSI2P";
	begin(&grey);
	assert_int_equal(granted.format, PIXEL_GREY16);
	assert_int_equal(granted.bits, 10);
	take(&frame);
	const uint8_t *packed = fake_libcamera_pixels((uint32_t)(uintptr_t)frame.token) + 80 + 5;
	const uint16_t *words =
		(const uint16_t *)(const void *)(frame.pixels + frame.stride_bytes) + 4;

	for (int i = 0; i < 4; i++)
		assert_int_equal(words[i], packed[i] << 2 | (packed[4] >> 2 * i & 3));
	release(&frame);
}

static void lost_frames_are_gaps_and_damaged_ones_are_told(void **state)
{
	uint64_t expected = 0;
	int damaged = 0, lost = 0;

	(void)state;
	fake.lose_every = 5;
	fake.damage_every = 7;
	begin(&grey);
	while (expected < 60) {
		struct frame frame;
		int error = next(&frame);

		assert_true(error == 0 || error == -EBADMSG);
		damaged += error == -EBADMSG;
		if (error)
			continue;
		for (; expected < frame.device_seq; expected++)
			lost += expected % 5 == 4;
		assert_int_equal(frame.device_seq % 5 == 4, 0);
		expected++;
		release(&frame);
	}
	assert_in_range(lost, 11, 12);
	assert_in_range(damaged, 6, 8); /* one of them was lost */
}

static void a_stall_loses_frames_and_all_goes_on(void **state)
{
	struct frame held[6], frame;

	(void)state;
	begin(&grey);
	for (int i = 0; i < 6; i++)
		take(&held[i]);
	assert_int_equal(driver->acquire(camera, 30 * NS_PER_MS, &frame), -ETIMEDOUT);
	for (int i = 0; i < 6; i++)
		release(&held[i]);
	take(&frame);
	assert_true(frame.device_seq > held[5].device_seq + 1);
	release(&frame);
}

static void an_unplugged_camera_is_gone_and_never_asked_to_stop(void **state)
{
	struct frame frame;
	int error;

	(void)state;
	begin(&grey);
	take(&frame);
	release(&frame);
	fake_libcamera_unplug();
	while ((error = next(&frame)) == 0)
		release(&frame);
	assert_int_equal(error, -ENODEV);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
	driver->stop(camera);
	close_camera();
	assert_int_equal(fake.stops, 0);
	assert_int_equal(fake.closes, 0);
	assert_int_equal(fake.abandons, 1);
	assert_int_equal(configure(&grey), -ENODEV);
	assert_told(FAKE_ID, NULL);
	fake.unseen = false;
	begin(&grey);
	take(&frame);
	release(&frame);
}

static void a_camera_that_cancels_everything_is_given_up(void **state)
{
	struct frame frame;
	int error, cancelled = 0;

	(void)state;
	fake.cancels = true;
	begin(&grey);
	while ((error = next(&frame)) == -EBADMSG)
		cancelled++;
	assert_int_equal(error, -EIO);
	assert_in_range(cancelled, 10, 200);
}

static void settings_reach_the_camera_within_its_range(void **state)
{
	struct camera_mode wanted = {.format = PIXEL_GREY8,
				     .period_ns = 12 * NS_PER_MS,
				     .exposure_ns = 500 * NS_PER_US,
				     .gain_db = 6};

	(void)state;
	begin(&wanted);
	assert_int_equal(granted.period_ns, 12 * NS_PER_MS);
	assert_int_equal(granted.exposure_ns, 500 * NS_PER_US);
	assert_true(granted.gain_db > 5.99 && granted.gain_db < 6.01);
	assert_true(fake.light.values[LIBCAMERA_EXPOSURE_US] == 500);
	assert_true(fake.light.values[LIBCAMERA_PERIOD_US] == 12000);
	assert_true(fake.light.values[LIBCAMERA_GAIN] > 1.99 &&
		    fake.light.values[LIBCAMERA_GAIN] < 2.01);
	driver->stop(camera);
	wanted.exposure_ns = NS_PER_S;
	begin(&wanted);
	assert_int_equal(granted.exposure_ns, 8000 * NS_PER_US);
	driver->stop(camera);
	wanted = grey;
	begin(&wanted); /* nothing is wanted, nothing is set */
	assert_true(fake.light.values[LIBCAMERA_EXPOSURE_US] == 0);
	assert_true(fake.light.values[LIBCAMERA_GAIN] == 0);
}

static void what_cannot_be_is_refused_with_its_remedy(void **state)
{
	struct camera_mode wanted = grey;

	(void)state;
	wanted.width_px = 640;
	assert_int_equal(configure(&wanted), -EINVAL);
	assert_told(FAKE_ID, "size: 640x", "64x48", NULL);
	wanted = grey;
	wanted.period_ns = 5 * NS_PER_MS;
	assert_int_equal(configure(&wanted), -EINVAL);
	assert_told(FAKE_ID, "200 Hz is wanted", "111.111 Hz", "lower rate_hz", NULL);
	wanted = grey;
	wanted.triggered = true;
	assert_int_equal(configure(&wanted), -ENOTSUP);
	assert_told(FAKE_ID, "trigger", NULL);
	fake.high[LIBCAMERA_EXPOSURE_US] = fake.high[LIBCAMERA_GAIN] = 0;
	wanted = grey;
	wanted.exposure_ns = NS_PER_MS;
	assert_int_equal(configure(&wanted), -ENOTSUP);
	assert_told(FAKE_ID, "exposure_us", "take it out", NULL);
	wanted = grey;
	wanted.gain_db = 3;
	assert_int_equal(configure(&wanted), -ENOTSUP);
	assert_told(FAKE_ID, "gain_db", "take it out", NULL);
	wanted = grey;
	fake.formats[0] = "XRGB8888";
	fake.formats[1] = "SRGGB10";
	assert_int_equal(configure(&wanted), -ENOTSUP);
	assert_told(FAKE_ID, "grey is wanted", "XRGB8888, SRGGB10", NULL);
	fake.formats[0] = "R8";
	fake.stride_bytes = 63;
	assert_int_equal(configure(&grey), -ENOTSUP);
	assert_told(FAKE_ID, "rows of 63 bytes", NULL);
}

static void a_camera_is_found_by_its_model_and_told_to_be_busy(void **state)
{
	(void)state;
	assert_int_equal(driver->open(&camera, "model=ov9281", NULL, &diag), 0);
	close_camera();
	fake.busy = true;
	assert_int_equal(driver->open(&camera, "model=ov9281", NULL, &diag), -EBUSY);
	assert_told("libcamera:model=ov9281", "another program", NULL);
	assert_int_equal(driver->open(&camera, "model=imx219", NULL, &diag), -ENODEV);
	assert_told("libcamera:model=imx219", FAKE_ID " (ov9281)", NULL);
}

static void count(const struct camera_info *info, void *user)
{
	assert_string_equal(info->address, "libcamera:" FAKE_ID);
	++*(int *)user;
}

static void cameras_on_usb_are_left_to_v4l2(void **state)
{
	int listed = 0;

	(void)state;
	assert_int_equal(driver->list(count, &listed, &diag), 0);
	assert_int_equal(listed, 1);
	fake.id = "\\_SB_.PCI0.XHC_.RHUB.HS07-7:1.0-046d:0825";
	assert_int_equal(driver->list(count, &listed, &diag), 0);
	assert_int_equal(listed, 1);
	assert_int_equal(driver->open(&camera, fake.id, NULL, &diag), -ENOTSUP);
	assert_told(fake.id, "USB camera", "v4l2", NULL);
}

static void the_sensors_name_tells_its_shutter(void **state)
{
	struct camera_mode wanted = grey;

	(void)state;
	wanted.shutter = SHUTTER_ROLLING; /* the operator is wrong */
	assert_int_equal(configure(&wanted), 0);
	assert_int_equal(granted.shutter, SHUTTER_GLOBAL);
	assert_int_equal(granted.row_time_ns, 0);
	fake.model = "imx219";
	wanted.shutter = SHUTTER_GLOBAL;
	wanted.readout_ns = 48 * 20 * NS_PER_US;
	assert_int_equal(configure(&wanted), 0);
	assert_int_equal(granted.shutter, SHUTTER_ROLLING);
	assert_int_equal(granted.row_time_ns, 20 * NS_PER_US);
	fake.model = "unheard-of";
	assert_int_equal(configure(&wanted), 0);
	assert_int_equal(granted.shutter, SHUTTER_GLOBAL);
}

/* Whatever the camera stamps, and on which clock. */
static void check_stamps(const struct camera_mode *wanted, int64_t bound_ns)
{
	begin(wanted);
	for (int i = 0; i < 30; i++) {
		struct frame frame;

		take(&frame);
		int64_t error_ns =
			frame.mid_exposure_ns - fake.truth_ns[frame.device_seq % FAKE_TRUTHS];

		assert_true(llabs(error_ns) <= frame.uncertainty_ns);
		assert_true(i < 16 || frame.uncertainty_ns <= bound_ns);
		release(&frame);
	}
	driver->stop(camera);
}

static void stamps_are_true_whatever_they_mark(void **state)
{
	struct camera_mode wanted = {
		.format = PIXEL_GREY8, .period_ns = 10 * NS_PER_MS, .exposure_ns = NS_PER_MS};

	(void)state;
	check_stamps(&wanted, 650 * NS_PER_US);
	fake.stamps_exposure = true;
	check_stamps(&wanted, 650 * NS_PER_US);
	fake.stamps_exposure = false;
	fake.stamps_end = true;
	wanted.readout_ns = fake.readout_ns;
	check_stamps(&wanted, 650 * NS_PER_US);
}

#define ON_CAMERA(test) cmocka_unit_test_setup_teardown(test, set_up, one_camera_tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		ON_CAMERA(frames_are_lent_in_the_cameras_own_memory),
		ON_CAMERA(words_packed_as_on_the_bus_are_unpacked),
		ON_CAMERA(lost_frames_are_gaps_and_damaged_ones_are_told),
		ON_CAMERA(a_stall_loses_frames_and_all_goes_on),
		ON_CAMERA(an_unplugged_camera_is_gone_and_never_asked_to_stop),
		ON_CAMERA(a_camera_that_cancels_everything_is_given_up),
		ON_CAMERA(settings_reach_the_camera_within_its_range),
		ON_CAMERA(what_cannot_be_is_refused_with_its_remedy),
		ON_CAMERA(a_camera_is_found_by_its_model_and_told_to_be_busy),
		ON_CAMERA(cameras_on_usb_are_left_to_v4l2),
		ON_CAMERA(the_sensors_name_tells_its_shutter),
		ON_CAMERA(stamps_are_true_whatever_they_mark),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("libcamera_faults", tests, NULL, NULL);
}
