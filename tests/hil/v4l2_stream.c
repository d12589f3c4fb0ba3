/*
 * A camera of the v4l2 driver, for tests.
 */
#include "tests/hil/v4l2_stream.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2.h"

void v4l2_stream_start(struct v4l2_stream *stream, const char *rest,
		       const struct camera_mode *wanted)
{
	const struct camera_driver *driver = &v4l2_camera_driver;
	struct diag diag = {0};
	int err = driver->open(&stream->camera, rest, NULL, &diag);

	if (!err)
		err = driver->configure(stream->camera, wanted, &stream->mode, &diag);
	if (!err)
		err = driver->start(stream->camera, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
}

void v4l2_stream_stop(struct v4l2_stream *stream)
{
	v4l2_camera_driver.stop(stream->camera);
	v4l2_camera_driver.close(stream->camera);
	stream->camera = NULL;
}

int v4l2_stream_next(struct v4l2_stream *stream, int patience_s, struct frame *out)
{
	int64_t until_ns = clock_now_ns() + patience_s * NS_PER_S;
	int err;

	do
		err = v4l2_camera_driver.acquire(stream->camera, 100 * NS_PER_MS, out);
	while (err == -ETIMEDOUT && clock_now_ns() < until_ns);
	return err;
}

void v4l2_stream_release(struct v4l2_stream *stream, struct frame *frame)
{
	v4l2_camera_driver.release(stream->camera, frame);
}
