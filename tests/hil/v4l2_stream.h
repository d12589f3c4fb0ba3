/*
 * A camera of the v4l2 driver as the tests of the virtual machine use one. Failing is cmocka's.
 */
#pragma once

#include "drivers/camera.h"

struct v4l2_stream {
	struct camera *camera;
	struct camera_mode mode; /* granted */
};

/* Opens, configures and starts; fails the test, with what the driver says, when it cannot. */
void v4l2_stream_start(struct v4l2_stream *stream, const char *rest,
		       const struct camera_mode *wanted);
void v4l2_stream_stop(struct v4l2_stream *stream);

/* The driver's next answer other than that nothing came, or that after `patience_s`. */
int v4l2_stream_next(struct v4l2_stream *stream, int patience_s, struct frame *out);
void v4l2_stream_release(struct v4l2_stream *stream, struct frame *frame);
