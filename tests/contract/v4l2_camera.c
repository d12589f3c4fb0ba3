/*
 * The camera of a test.
 */
#include "tests/contract/v4l2_camera.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"

#define PATIENCE_NS (5 * NS_PER_S)

const struct camera_driver *const driver = &v4l2_camera_driver;
struct camera *camera;
struct camera_mode granted;
struct diag diag;

int v4l2_set_up(void **state)
{
	(void)state;
	fake_v4l2_begin();
	camera = NULL;
	return 0;
}

int v4l2_tear_down(void **state)
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

void assert_told(const char *first, ...)
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

int open_and_configure(const char *rest, const struct camera_mode *wanted)
{
	int error = driver->open(&camera, rest, NULL, &diag);

	return error ? error : driver->configure(camera, wanted, &granted, &diag);
}

void begin(const char *settings, const struct camera_mode *wanted)
{
	fake_v4l2_plug(0, "A1", settings);
	int error = open_and_configure("/dev/video0", wanted);

	if (!error)
		error = driver->start(camera, &diag);
	if (error)
		fail_msg("%s", diag.text);
}

const struct camera_mode grey = {.format = PIXEL_GREY8};

int next(struct frame *frame)
{
	int64_t deadline_ns = clock_now_ns() + PATIENCE_NS;
	int error;

	do
		error = driver->acquire(camera, 50 * NS_PER_MS, frame);
	while (error == -ETIMEDOUT && clock_now_ns() < deadline_ns);
	return error;
}

void take(struct frame *frame)
{
	assert_int_equal(next(frame), 0);
}
