#include "tests/contract/one_camera.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/realtime.h"

#define PATIENCE_NS (10 * NS_PER_S)

struct camera *camera;
struct camera_mode granted;
struct diag diag;

void close_camera(void)
{
	driver->close(camera);
	camera = NULL;
}

int one_camera_tear_down(void **state)
{
	(void)state;
	close_camera();
	diag_finish(&diag);
	return 0;
}

int open_and_configure(const char *rest, const struct camera_mode *wanted)
{
	int error = camera ? 0 : driver->open(&camera, rest, NULL, &diag);

	return error ? error : driver->configure(camera, wanted, &granted, &diag);
}

void start_camera(const char *rest, const struct camera_mode *wanted)
{
	int error = open_and_configure(rest, wanted);

	if (!error)
		error = driver->start(camera, &diag);
	if (error)
		fail_msg("%s", diag.text);
}

int next(struct frame *frame)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	int error;

	do {
		realtime_enter();
		error = driver->acquire(camera, 50 * NS_PER_MS, frame);
		realtime_leave();
	} while (error == -ETIMEDOUT && clock_now_ns() < until_ns);
	return error;
}

void take(struct frame *frame)
{
	assert_int_equal(next(frame), 0);
}

void release(struct frame *frame)
{
	realtime_enter();
	driver->release(camera, frame);
	realtime_leave();
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
	diag_finish(&diag);
}
