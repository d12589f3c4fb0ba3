/*
 * The tests that every camera driver must pass.
 */
#include "tests/contract/camera_contract.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"

#define PATIENCE_NS (5 * NS_PER_S) /* for a frame of a driver that delivers at all */
#define SLACK_NS (500 * NS_PER_MS) /* of a busy machine */

static const struct camera_contract *contract;
static struct camera *camera;
static struct camera_mode granted;

static int open_camera(void **state)
{
	struct camera_mode wanted = {.width_px = contract->width_px,
				     .height_px = contract->height_px,
				     .format = contract->format,
				     .period_ns = contract->period_ns};
	struct diag diag = {0};

	(void)state;
	camera = NULL;
	int err = contract->driver->open(&camera, contract->rest, contract->base_dir, &diag);
	if (!err)
		err = contract->driver->configure(camera, &wanted, &granted, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err;
}

static int close_camera(void **state)
{
	(void)state;
	contract->driver->close(camera);
	return 0;
}

static void start_camera(void)
{
	struct diag diag = {0};

	assert_int_equal(contract->driver->start(camera, &diag), 0);
	assert_int_equal(diag.count, 0);
}

/* The next whole frame. */
static void take_frame(struct frame *frame)
{
	int64_t deadline_ns = clock_now_ns() + PATIENCE_NS;
	int err;

	do
		err = contract->driver->acquire(camera, 100 * NS_PER_MS, frame);
	while ((err == -ETIMEDOUT || err == -EBADMSG) && clock_now_ns() < deadline_ns);
	assert_int_equal(err, 0);
}

static void opening_nothing_fails_with_one_message_that_names_it(void **state)
{
	struct camera *untouched = (struct camera *)state;
	struct camera *out = untouched;
	struct diag diag = {0};

	assert_true(contract->driver->open(&out, contract->bad_rest, contract->base_dir, &diag) <
		    0);
	assert_ptr_equal(out, untouched);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, contract->bad_rest));
	diag_finish(&diag);
}

static void closing_nothing_is_harmless(void **state)
{
	(void)state;
	contract->driver->close(NULL);
}

static void count_found(const struct camera_info *info, void *user)
{
	size_t length = strlen(contract->driver->name);

	assert_int_equal(strncmp(info->address, contract->driver->name, length), 0);
	assert_int_equal(info->address[length], ':');
	++*(int *)user;
}

static void listed_devices_bear_addresses_of_the_driver(void **state)
{
	struct diag diag = {0};
	int count = 0;

	(void)state;
	assert_int_equal(contract->driver->list(count_found, &count, &diag), 0);
	assert_int_equal(diag.count, 0);
}

static void configure_grants_a_mode_that_can_be(void **state)
{
	(void)state;
	assert_ptr_equal(camera->driver, contract->driver);
	assert_true(granted.width_px > 0 && granted.height_px > 0);
	assert_int_equal(granted.format, contract->format);
	assert_true(granted.period_ns >= 0 && granted.exposure_ns >= 0);
}

static void check_frame(const struct frame *frame)
{
	assert_int_equal(frame->width_px, granted.width_px);
	assert_int_equal(frame->height_px, granted.height_px);
	assert_int_equal(frame->format, granted.format);
	if (frame->format == PIXEL_MJPEG)
		assert_true(frame->size_bytes > 4);
	else
		assert_true((size_t)frame->stride_bytes >=
			    pixel_row_bytes(frame->format, frame->width_px));
	assert_int_equal(frame->bits, granted.bits);
	assert_true(frame->uncertainty_ns >= 0 && frame->row_time_ns >= 0);
	assert_true(frame->arrival_ns >= frame->mid_exposure_ns);
	if (contract->live) {
		int64_t now_ns = clock_now_ns();

		assert_true(frame->arrival_ns <= now_ns);
		assert_true(frame->mid_exposure_ns > now_ns - PATIENCE_NS);
	}
}

/* Every byte can be read, and the picture is more than one colour. */
static void check_pixels(const struct frame *frame)
{
	bool packed = frame->format == PIXEL_MJPEG;
	long row_bytes = packed ? (long)frame->size_bytes
				: (long)pixel_row_bytes(frame->format, frame->width_px);
	int low = 255, high = 0;

	for (int y = 0; y < (packed ? 1 : frame->height_px); y++)
		for (long x = 0; x < row_bytes; x++) {
			int grey = frame->pixels[(long)y * frame->stride_bytes + x];

			low = grey < low ? grey : low;
			high = grey > high ? grey : high;
		}
	assert_true(high > low);
}

static void frames_come_whole_and_in_order(void **state)
{
	uint64_t last_seq = 0;
	int64_t last_ns = 0;

	(void)state;
	start_camera();
	for (int i = 0; i < contract->frame_count; i++) {
		struct frame frame;

		take_frame(&frame);
		check_frame(&frame);
		check_pixels(&frame);
		assert_true(i == 0 || frame.device_seq > last_seq);
		assert_true(i == 0 || frame.mid_exposure_ns > last_ns);
		last_seq = frame.device_seq;
		last_ns = frame.mid_exposure_ns;
		contract->driver->release(camera, &frame);
	}
	contract->driver->stop(camera);
}

static void acquire_waits_no_longer_than_it_was_told(void **state)
{
	static const int64_t timeouts_ns[] = {0, 1, NS_PER_MS, 20 * NS_PER_MS};

	(void)state;
	start_camera();
	for (size_t i = 0; i < sizeof(timeouts_ns) / sizeof(timeouts_ns[0]); i++) {
		struct frame frame;
		int64_t start_ns = clock_now_ns();
		int err = contract->driver->acquire(camera, timeouts_ns[i], &frame);

		assert_true(clock_now_ns() - start_ns < timeouts_ns[i] + SLACK_NS);
		assert_true(err == 0 || err == -ETIMEDOUT || err == -EBADMSG);
		if (!err)
			contract->driver->release(camera, &frame);
	}
	contract->driver->stop(camera);
}

static void stopping_twice_or_before_the_start_is_harmless(void **state)
{
	(void)state;
	contract->driver->stop(camera);
	start_camera();
	contract->driver->stop(camera);
	contract->driver->stop(camera);
}

/* With nothing from before the stop, as far as the bound on its time tells. */
static void a_stopped_camera_starts_again(void **state)
{
	int64_t stopped_ns = 0;

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct frame frame;

		start_camera();
		take_frame(&frame);
		check_frame(&frame);
		if (contract->live)
			assert_true(frame.mid_exposure_ns + frame.uncertainty_ns >= stopped_ns);
		contract->driver->release(camera, &frame);
		clock_sleep_until(clock_now_ns() + 50 * NS_PER_MS); /* frames wait to be taken */
		stopped_ns = clock_now_ns();
		contract->driver->stop(camera);
	}
}

/* As for a calibration, and back. */
static void a_stopped_camera_takes_another_exposure(void **state)
{
	struct camera_mode wanted = {.width_px = contract->width_px,
				     .height_px = contract->height_px,
				     .format = contract->format,
				     .period_ns = 12 * NS_PER_S / 100,
				     .exposure_ns = 3 * NS_PER_MS};
	struct camera_mode lit;
	struct diag diag = {0};
	struct frame frame;

	(void)state;
	start_camera();
	take_frame(&frame);
	contract->driver->release(camera, &frame);
	contract->driver->stop(camera);
	int err = contract->driver->configure(camera, &wanted, &lit, &diag);

	if (err == -ENOTSUP) { /* there is no such control, and it said so */
		assert_int_equal(diag.count, 1);
		wanted.exposure_ns = 0;
		err = contract->driver->configure(camera, &wanted, &lit, &diag);
	}
	assert_int_equal(err, 0);
	assert_int_equal(lit.width_px, granted.width_px);
	assert_int_equal(lit.height_px, granted.height_px);
	start_camera();
	take_frame(&frame);
	contract->driver->release(camera, &frame);
	contract->driver->stop(camera);
	diag_finish(&diag);
}

static void a_closed_camera_opens_again(void **state)
{
	struct frame frame;

	assert_int_equal(close_camera(state), 0);
	assert_int_equal(open_camera(state), 0);
	start_camera();
	take_frame(&frame);
	contract->driver->release(camera, &frame);
	contract->driver->stop(camera);
}

#define WITH_CAMERA(test) cmocka_unit_test_setup_teardown(test, open_camera, close_camera)

int camera_contract_run(const struct camera_contract *wanted)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(opening_nothing_fails_with_one_message_that_names_it),
		cmocka_unit_test(closing_nothing_is_harmless),
		cmocka_unit_test(listed_devices_bear_addresses_of_the_driver),
		WITH_CAMERA(configure_grants_a_mode_that_can_be),
		WITH_CAMERA(frames_come_whole_and_in_order),
		WITH_CAMERA(acquire_waits_no_longer_than_it_was_told),
		WITH_CAMERA(stopping_twice_or_before_the_start_is_harmless),
		WITH_CAMERA(a_stopped_camera_starts_again),
		WITH_CAMERA(a_stopped_camera_takes_another_exposure),
		WITH_CAMERA(a_closed_camera_opens_again),
	};

	contract = wanted;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name(wanted->driver->name, tests, NULL, NULL);
}
