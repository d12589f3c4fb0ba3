/*
 * The v4l2 driver on a kernel device that fails on demand: vivid_faults NODE, a node of vivid.
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
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmocka.h>
#include <linux/videodev2.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2.h"
#include "tests/hil/v4l2_stream.h"

#define PATIENCE_S 10

static const char *node;
static const struct camera_mode wanted = {.format = PIXEL_GREY8, .period_ns = NS_PER_S / 30};

/* Sets the control of this name; with a button the value does not matter. */
static void set_fault(const char *name, int value)
{
	struct v4l2_query_ext_ctrl control = {0};
	int fd = open(node, O_RDWR | O_CLOEXEC);

	assert_true(fd >= 0);
	do {
		control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
		if (ioctl(fd, VIDIOC_QUERY_EXT_CTRL, &control))
			fail_msg("%s has no control '%s'", node, name);
	} while (strcmp(control.name, name) != 0);
	struct v4l2_control set = {.id = control.id, .value = value};

	assert_int_equal(ioctl(fd, VIDIOC_S_CTRL, &set), 0);
	close(fd);
}

/* The next answer that is no frame; frames before it are whole, one after the other. */
static int first_error(struct v4l2_stream *stream, int frames_max)
{
	struct frame frame;
	int err = 0;

	for (int i = 0; i < frames_max && !err; i++) {
		err = v4l2_stream_next(stream, PATIENCE_S, &frame);
		if (!err)
			v4l2_stream_release(stream, &frame);
	}
	return err;
}

/* How many bytes from here on are a map of this device, the kernel's own buffer; 0: none. */
static size_t mapped_bytes(const uint8_t *at)
{
	FILE *maps = fopen("/proc/self/maps", "re");
	char line[512];
	size_t bytes = 0;

	assert_non_null(maps);
	while (fgets(line, sizeof(line), maps)) {
		uintptr_t begin, end;

		if (sscanf(line, "%" SCNxPTR "-%" SCNxPTR, &begin, &end) == 2 &&
		    begin <= (uintptr_t)at && (uintptr_t)at < end && strstr(line, node))
			bytes = end - (uintptr_t)at;
	}
	fclose(maps);
	return bytes;
}

/* Every frame is lent in the buffer that the kernel filled: nobody has copied. */
static void pixels_lie_in_the_buffers_of_the_device(void **state)
{
	struct v4l2_stream stream;
	const uint8_t *first = NULL;
	bool returned = false, other = false;

	(void)state;
	v4l2_stream_start(&stream, node, &wanted);
	for (int i = 0; i < 40; i++) {
		struct frame frame;

		assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
		assert_true(mapped_bytes(frame.pixels) >=
			    (size_t)frame.stride_bytes * (size_t)frame.height_px);
		returned |= frame.pixels == first;
		other |= first && frame.pixels != first;
		first = first ? first : frame.pixels;
		v4l2_stream_release(&stream, &frame);
	}
	v4l2_stream_stop(&stream);
	assert_true(returned && other); /* each in its turn */
}

static void dropped_buffers_are_gaps_in_the_counter(void **state)
{
	struct v4l2_stream stream;
	uint64_t last_seq = 0, lost = 0;

	(void)state;
	v4l2_stream_start(&stream, node, &wanted);
	set_fault("Percentage of Dropped Buffers", 40);
	for (int i = 0; i < 40; i++) {
		struct frame frame;

		assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
		assert_true(i == 0 || frame.device_seq > last_seq);
		lost += i > 0 ? frame.device_seq - last_seq - 1 : 0;
		last_seq = frame.device_seq;
		v4l2_stream_release(&stream, &frame);
	}
	set_fault("Percentage of Dropped Buffers", 0);
	v4l2_stream_stop(&stream);
	assert_true(lost > 0);
}

static void damaged_frame_is_told_and_the_next_one_is_whole(void **state)
{
	struct v4l2_stream stream;
	struct frame frame;

	(void)state;
	v4l2_stream_start(&stream, node, &wanted);
	assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
	uint64_t before_seq = frame.device_seq;

	v4l2_stream_release(&stream, &frame);
	set_fault("Inject V4L2_BUF_FLAG_ERROR", 1);
	assert_int_equal(first_error(&stream, 60), -EBADMSG);
	assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
	assert_true(frame.device_seq > before_seq + 1); /* it was counted */
	v4l2_stream_release(&stream, &frame);
	v4l2_stream_stop(&stream);
}

/* What comes of a stream that broke is no frame and no wait for ever; a new start mends it. */
static void broken_stream_is_told_and_starts_again(void **state)
{
	struct v4l2_stream stream;
	struct frame frame;
	struct diag diag = {0};

	(void)state;
	v4l2_stream_start(&stream, node, &wanted);
	assert_int_equal(first_error(&stream, 3), 0);
	set_fault("Inject Fatal Streaming Error", 1);
	int err = first_error(&stream, 60);

	assert_true(err < 0 && err != -ETIMEDOUT && err != -EBADMSG);
	v4l2_camera_driver.stop(stream.camera);
	assert_int_equal(v4l2_camera_driver.start(stream.camera, &diag), 0);
	diag_finish(&diag);
	assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
	v4l2_stream_release(&stream, &frame);
	v4l2_stream_stop(&stream);
}

static void start_that_fails_is_told_and_the_next_one_works(void **state)
{
	struct v4l2_stream stream;
	struct camera_mode granted;
	struct diag diag = {0};
	struct frame frame;

	(void)state;
	assert_int_equal(v4l2_camera_driver.open(&stream.camera, node, NULL, &diag), 0);
	assert_int_equal(v4l2_camera_driver.configure(stream.camera, &wanted, &granted, &diag), 0);
	set_fault("Inject VIDIOC_STREAMON Error", 1);
	assert_true(v4l2_camera_driver.start(stream.camera, &diag) < 0);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, node));
	diag_finish(&diag);
	assert_int_equal(v4l2_camera_driver.start(stream.camera, &diag), 0);
	assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
	v4l2_stream_release(&stream, &frame);
	v4l2_stream_stop(&stream);
}

/* Once all have closed it, vivid plugs itself in again. */
static void unplugged_camera_is_gone_for_good_and_opens_again_when_it_is_back(void **state)
{
	struct v4l2_stream stream;
	struct frame frame;

	(void)state;
	v4l2_stream_start(&stream, node, &wanted);
	assert_int_equal(first_error(&stream, 3), 0);
	set_fault("Disconnect", 1);
	assert_int_equal(first_error(&stream, 60), -ENODEV);
	assert_int_equal(v4l2_camera_driver.acquire(stream.camera, 0, &frame), -ENODEV);
	v4l2_stream_stop(&stream);
	v4l2_stream_start(&stream, node, &wanted);
	assert_int_equal(first_error(&stream, 3), 0);
	v4l2_stream_stop(&stream);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pixels_lie_in_the_buffers_of_the_device),
		cmocka_unit_test(dropped_buffers_are_gaps_in_the_counter),
		cmocka_unit_test(damaged_frame_is_told_and_the_next_one_is_whole),
		cmocka_unit_test(broken_stream_is_told_and_starts_again),
		cmocka_unit_test(start_that_fails_is_told_and_the_next_one_works),
		cmocka_unit_test(unplugged_camera_is_gone_for_good_and_opens_again_when_it_is_back),
	};

	if (argc != 2) {
		fprintf(stderr, "usage: %s NODE\n", argv[0]);
		return EXIT_FAILURE;
	}
	node = argv[1];
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
