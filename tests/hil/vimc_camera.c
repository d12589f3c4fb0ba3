/*
 * The libcamera driver on the kernel's simulated sensor and image processor: vimc_camera STAGECTL.
 */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera.h"
#include "tests/contract/one_camera.h"

#define CAMERA "platform/vimc.0 Sensor B"
#define PATIENCE_NS (10 * NS_PER_S)
#define PICTURE_BLACK 5 /* of test_pattern */
#define PICTURE_WHITE 6

const struct camera_driver *const driver = &libcamera_camera_driver;
static const struct camera_mode small = {.width_px = 480, .height_px = 360, .format = PIXEL_RGB8};
static const char *stagectl;

static void begin(const struct camera_mode *wanted)
{
	start_camera(CAMERA, wanted);
}

/* What this process has mapped at an address. */
static void mapped_at(const void *at, char *name, size_t size)
{
	FILE *maps = fopen("/proc/self/maps", "re");
	char line[400];

	*name = '\0';
	assert_non_null(maps);
	while (!*name && fgets(line, sizeof(line), maps)) {
		uintptr_t from, to;

		if (sscanf(line, "%" SCNxPTR "-%" SCNxPTR, &from, &to) == 2 &&
		    (uintptr_t)at >= from && (uintptr_t)at < to)
			snprintf(name, size, "%s", line);
	}
	fclose(maps);
}

static void frames_lie_where_the_kernel_wrote_them(void **state)
{
	const uint8_t *seen[64] = {NULL};
	char name[400];
	int buffers = 0;

	(void)state;
	begin(&small);
	for (int i = 0; i < 16; i++) {
		struct frame frame;
		int b = 0;

		take(&frame);
		mapped_at(frame.pixels, name, sizeof(name));
		if (!strstr(name, "dmabuf"))
			fail_msg("no dmabuf: %s", name);
		while (b < buffers && seen[b] != frame.pixels)
			b++;
		seen[b] = frame.pixels;
		buffers += b == buffers;
		release(&frame);
	}
	assert_in_range(buffers, 1, 8); /* the same ones again and again */
}

static void held_frames_stay_and_go_on_when_they_are_released(void **state)
{
	struct frame held[32];
	uint64_t last_seq;
	int count = 0;

	(void)state;
	begin(&small);
	while (count < 32 && driver->acquire(camera, 3 * NS_PER_S, &held[count]) == 0)
		count++;
	assert_in_range(count, 2, 31); /* then there were no buffers left */
	last_seq = held[count - 1].device_seq;
	for (int i = 0; i < count; i++) {
		assert_true(i == 0 || held[i].device_seq > held[i - 1].device_seq);
		driver->release(camera, &held[i]);
	}
	for (int i = 0; i < 2 * count; i++) {
		struct frame frame;

		take(&frame);
		assert_true(frame.device_seq > last_seq);
		last_seq = frame.device_seq;
		release(&frame);
	}
}

static void stamps_lie_before_the_arrival_within_their_bounds(void **state)
{
	(void)state;
	begin(&small);
	for (int i = 0; i < 40; i++) {
		struct frame frame;

		take(&frame);
		assert_true(frame.mid_exposure_ns <= frame.arrival_ns);
		/* of a camera that tells neither rate, exposure nor shutter */
		assert_in_range(frame.uncertainty_ns, 1, 100 * NS_PER_MS);
		release(&frame);
	}
}

static int brightness(const struct camera_mode *wanted)
{
	struct frame frame;
	int64_t sum = 0;

	begin(wanted);
	for (int i = 0; i < 3; i++) { /* vimc's first may be empty */
		take(&frame);
		release(&frame);
	}
	take(&frame);
	for (int y = 0; y < frame.height_px; y++)
		for (int x = 0; x < 3 * frame.width_px; x++)
			sum += frame.pixels[(long)y * frame.stride_bytes + x];
	close_camera();
	return (int)(sum / (3 * frame.width_px * frame.height_px));
}

static void the_sensors_own_controls_can_be_set(void **state)
{
	struct camera_mode wanted = small;

	(void)state;
	wanted.control_count = 1;
	wanted.controls[0] = (struct camera_control){"test_pattern", PICTURE_BLACK};
	int black = brightness(&wanted);

	wanted.controls[0].value = PICTURE_WHITE;
	assert_true(brightness(&wanted) > black + 60);
}

static void what_the_camera_has_not_is_refused_by_name(void **state)
{
	static const struct {
		struct camera_mode wanted;
		int error;
		const char *words[2];
	} refused[] = {
		{{.format = PIXEL_GREY8}, -ENOTSUP, {"pixel format: grey", "BGR888"}},
		{{.format = PIXEL_RGB8, .width_px = 5000, .height_px = 5000},
		 -EINVAL,
		 {"size: 5000x5000", "640x480"}},
		{{.format = PIXEL_RGB8, .exposure_ns = NS_PER_MS},
		 -ENOTSUP,
		 {"exposure_us", CAMERA}},
		{{.format = PIXEL_RGB8, .gain_db = 6}, -ENOTSUP, {"gain_db", CAMERA}},
		{{.format = PIXEL_RGB8, .triggered = true}, -ENOTSUP, {"trigger", "Sensor B"}},
		{{.format = PIXEL_RGB8, .control_count = 1, .controls = {{"iris", 1}}},
		 -EINVAL,
		 {"no iris", "test_pattern"}},
	};

	(void)state;
	assert_int_equal(driver->open(&camera, CAMERA, NULL, &diag), 0);
	for (size_t i = 0; i < sizeof(refused) / sizeof(refused[0]); i++) {
		assert_int_equal(driver->configure(camera, &refused[i].wanted, &granted, &diag),
				 refused[i].error);
		assert_told(refused[i].words[0], refused[i].words[1], NULL);
	}
}

static void a_camera_in_use_is_busy_for_another_program(void **state)
{
	char command[400], answer[600] = "";
	FILE *other;

	(void)state;
	begin(&small);
	snprintf(command, sizeof(command), "'%s' camera show 'libcamera:" CAMERA "' 2>&1",
		 stagectl);
	other = popen(command, "re");
	assert_non_null(other);
	assert_non_null(fgets(answer, sizeof(answer), other));
	assert_int_not_equal(pclose(other), 0);
	if (!strstr(answer, "another program uses it"))
		fail_msg("%s", answer);
}

static void bind_driver(const char *file)
{
	char path[80];

	snprintf(path, sizeof(path), "/sys/bus/platform/drivers/vimc/%s", file);
	int fd = open(path, O_WRONLY | O_CLOEXEC);

	assert_true(fd >= 0);
	assert_int_equal(write(fd, "vimc.0", 6), 6);
	close(fd);
}

static void an_unplugged_camera_is_gone_and_comes_back(void **state)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	struct frame frame;
	int error;

	(void)state;
	begin(&small);
	take(&frame);
	release(&frame);
	bind_driver("unbind");
	while ((error = next(&frame)) == 0 || error == -EBADMSG)
		if (!error)
			release(&frame);
	assert_int_equal(error, -ENODEV);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
	driver->stop(camera);
	close_camera();
	assert_int_equal(open_and_configure(CAMERA, &small), -ENODEV);
	assert_told(CAMERA, "no such camera", NULL);
	bind_driver("bind");
	until_ns = clock_now_ns() + PATIENCE_NS;
	while ((error = driver->open(&camera, CAMERA, NULL, &diag)) && clock_now_ns() < until_ns) {
		diag_finish(&diag);
		clock_sleep_until(clock_now_ns() + 100 * NS_PER_MS);
	}
	assert_int_equal(error, 0);
	assert_int_equal(driver->configure(camera, &small, &granted, &diag), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	take(&frame);
}

#define ON_CAMERA(test) cmocka_unit_test_teardown(test, one_camera_tear_down)

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		ON_CAMERA(frames_lie_where_the_kernel_wrote_them),
		ON_CAMERA(held_frames_stay_and_go_on_when_they_are_released),
		ON_CAMERA(stamps_lie_before_the_arrival_within_their_bounds),
		ON_CAMERA(the_sensors_own_controls_can_be_set),
		ON_CAMERA(what_the_camera_has_not_is_refused_by_name),
		ON_CAMERA(a_camera_in_use_is_busy_for_another_program),
		ON_CAMERA(an_unplugged_camera_is_gone_and_comes_back),
	};

	if (argc < 2)
		return EXIT_FAILURE;
	stagectl = argv[1];
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("vimc_camera", tests, NULL, NULL);
}
