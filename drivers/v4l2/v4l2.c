/*
 * The v4l2 driver's frames. The kernel fills buffers that are mapped here; the capture thread reads
 * them where they are and gives them back. Only of YUYV, when grey is wanted, every second byte is
 * copied.
 */
#include "drivers/v4l2/v4l2.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_device.h"
#include "drivers/v4l2/v4l2_time.h"

#define WAKE_NS (1 * NS_PER_MS) /* from a picture's being ready to the thread's running */

struct v4l2_camera {
	struct camera base;

	/* set before the stream starts */
	struct v4l2_device device;
	struct camera_mode mode;
	struct v4l2_layout layout;
	struct v4l2_timing timing;
	struct v4l2_buffers buffers;
	uint8_t *luma; /* owned; NULL unless layout.takes_luma */
	bool streams;

	/* owned by the capture thread */
	int lost;           /* a negative errno, once the device is of no more use */
	int64_t not_yet_ns; /* when no picture was waiting */
	bool counts;        /* a frame has come: */
	uint32_t last_sequence;
	uint64_t device_seq;
};

static int v4l2_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	struct v4l2_camera *camera = calloc(1, sizeof(*camera));
	int error;

	(void)base_dir;
	if (!camera) {
		diag_add(diag, "v4l2:%s: out of memory", rest);
		return -ENOMEM;
	}
	camera->base.driver = &v4l2_camera_driver;
	error = v4l2_open_device(&camera->device, rest, diag);
	if (error) {
		free(camera);
		return error;
	}
	*out = &camera->base;
	return 0;
}

static void v4l2_stop(struct camera *base);

static void v4l2_close(struct camera *base)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;

	if (!camera)
		return;
	v4l2_stop(base);
	v4l2_unmap_buffers(&camera->device, &camera->buffers);
	free(camera->luma);
	close(camera->device.fd);
	free(camera);
}

static int make_luma(struct v4l2_camera *camera, struct diag *diag)
{
	size_t luma_bytes = (size_t)camera->mode.width_px * (size_t)camera->mode.height_px;

	free(camera->luma);
	camera->luma = NULL;
	if (!camera->layout.takes_luma)
		return 0;
	camera->luma = malloc(luma_bytes);
	if (!camera->luma)
		return v4l2_fail(&camera->device, -ENOMEM, "buffers", diag);
	memset(camera->luma, 0, luma_bytes); /* every page is there now */
	return 0;
}

static int v4l2_configure(struct camera *base, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct diag *diag)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;
	int error;

	v4l2_unmap_buffers(&camera->device, &camera->buffers);
	error = v4l2_configure_device(&camera->device, wanted, &camera->mode, &camera->layout,
				      diag);
	if (!error)
		error = v4l2_map_buffers(&camera->device, camera->mode.period_ns,
					 camera->layout.size_bytes, &camera->buffers, diag);
	if (!error)
		error = make_luma(camera, diag);
	if (error)
		return error;
	camera->timing = (struct v4l2_timing){
		.period_ns = camera->mode.period_ns,
		.exposure_ns =
			camera->mode.exposure_ns ? camera->mode.exposure_ns : wanted->exposure_ns,
		.readout_ns = wanted->readout_ns,
		.may_roll = camera->mode.shutter != SHUTTER_GLOBAL,
		.rows_ns = camera->mode.row_time_ns * (camera->mode.height_px - 1),
		.stamps_first_bytes = v4l2_stamps_first_bytes(&camera->device),
	};
	*granted = camera->mode;
	return 0;
}

static int v4l2_start(struct camera *base, struct diag *diag)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;
	uint32_t type = camera->device.type;
	int error = 0;

	assert(camera->buffers.count && !camera->streams);
	camera->lost = 0;
	camera->counts = false;
	camera->device_seq = 0;
	camera->not_yet_ns = clock_now_ns();
	v4l2_time_begin(&camera->timing, camera->not_yet_ns);
	for (uint32_t i = 0; i < camera->buffers.count && !error; i++)
		error = v4l2_queue(&camera->device, i);
	if (!error)
		error = v4l2_ask(camera->device.fd, VIDIOC_STREAMON, &type);
	camera->streams = true; /* even if not: what was queued comes back */
	if (!error)
		return 0;
	v4l2_stop(base);
	return v4l2_fail(&camera->device, error, "start", diag);
}

static void v4l2_stop(struct camera *base)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;
	uint32_t type = camera->device.type;

	if (camera->streams)
		v4l2_ask(camera->device.fd, VIDIOC_STREAMOFF, &type);
	camera->streams = false;
}

/* 0 when a picture is there, or something is wrong that the device will tell. */
static int wait_ready(const struct v4l2_camera *camera, int64_t timeout_ns, short *events)
{
	struct pollfd device = {.fd = camera->device.fd, .events = POLLIN};
	int64_t give_up_ns = clock_now_ns() + timeout_ns;
	int result;

	do {
		int64_t left_ns = give_up_ns - clock_now_ns();
		struct timespec left = {.tv_sec = left_ns / NS_PER_S,
					.tv_nsec = left_ns % NS_PER_S};

		result = left_ns > 0 ? ppoll(&device, 1, &left, NULL) : 0;
	} while (result < 0 && errno == EINTR);
	*events = device.revents;
	return result > 0 ? 0 : result == 0 ? -ETIMEDOUT : -errno;
}

/* A picture that waited before it was asked for came at some time since not_yet_ns. */
static int take_buffer(struct v4l2_camera *camera, int64_t timeout_ns, struct v4l2_filled *buffer)
{
	int64_t asked_ns = clock_now_ns();
	short events = 0;
	int error = v4l2_dequeue(&camera->device, buffer);

	if (error != -EAGAIN)
		return error;
	camera->not_yet_ns = asked_ns;
	error = wait_ready(camera, timeout_ns, &events);
	if (error)
		return error;
	int64_t woken_ns = clock_now_ns();

	if (woken_ns - WAKE_NS > asked_ns)
		camera->not_yet_ns = woken_ns - WAKE_NS;
	error = v4l2_dequeue(&camera->device, buffer);
	if (error == -EAGAIN) /* with an error told, it would be told again at once, for ever */
		return events & POLLERR ? -EIO : -ETIMEDOUT;
	return error;
}

/* A device whose sequence stands still, or runs back, does not count: then its frames are. */
static void count_frame(struct v4l2_camera *camera, uint32_t sequence)
{
	uint32_t step = sequence - camera->last_sequence;

	camera->device_seq += !camera->counts ? sequence : step == 0 || step > INT32_MAX ? 1 : step;
	camera->counts = true;
	camera->last_sequence = sequence;
}

static const uint8_t *pixels_of(const struct v4l2_camera *camera, const struct v4l2_filled *buffer)
{
	return camera->buffers.pixels[buffer->index] + buffer->offset_bytes;
}

static bool whole(const struct v4l2_camera *camera, const struct v4l2_filled *buffer)
{
	if (buffer->flags & V4L2_BUF_FLAG_ERROR || buffer->index >= camera->buffers.count)
		return false;
	size_t end_bytes = camera->buffers.size_bytes[buffer->index];
	size_t least_bytes = camera->mode.format == PIXEL_MJPEG ? 5 : camera->layout.size_bytes;

	if (buffer->used_bytes && buffer->used_bytes < end_bytes)
		end_bytes = buffer->used_bytes;
	if (buffer->used_bytes > camera->buffers.size_bytes[buffer->index] ||
	    buffer->offset_bytes > end_bytes || buffer->offset_bytes % 2 ||
	    end_bytes - buffer->offset_bytes < least_bytes)
		return false;
	const uint8_t *pixels = pixels_of(camera, buffer);

	return camera->mode.format != PIXEL_MJPEG || /* which begins as every JPEG */
	       (buffer->used_bytes && pixels[0] == 0xff && pixels[1] == 0xd8);
}

static void take_luma(const struct v4l2_camera *camera, const uint8_t *pixels)
{
	size_t width = (size_t)camera->mode.width_px;

	for (int y = 0; y < camera->mode.height_px; y++) {
		const uint8_t *from = pixels + (size_t)y * (size_t)camera->layout.stride_bytes;
		uint8_t *to = camera->luma + (size_t)y * width;

		for (size_t x = 0; x < width; x++)
			to[x] = from[2 * x];
	}
}

static void fill_frame(struct v4l2_camera *camera, const struct v4l2_filled *buffer,
		       struct frame *out)
{
	const uint8_t *pixels = pixels_of(camera, buffer);
	struct v4l2_stamp stamp = {
		.flags = buffer->flags,
		.stamp_ns = buffer->stamp_ns,
		.not_yet_ns = camera->not_yet_ns,
		.arrival_ns = clock_now_ns(),
	};

	v4l2_time(&camera->timing, &stamp);
	if (camera->luma)
		take_luma(camera, pixels);
	*out = (struct frame){
		.pixels = camera->luma ? camera->luma : pixels,
		.width_px = camera->mode.width_px,
		.height_px = camera->mode.height_px,
		.stride_bytes = camera->luma ? camera->mode.width_px : camera->layout.stride_bytes,
		.format = camera->mode.format,
		.bits = camera->mode.bits,
		.row_time_ns = camera->mode.row_time_ns,
		.size_bytes = camera->mode.format == PIXEL_MJPEG
				      ? buffer->used_bytes - buffer->offset_bytes
				      : 0,
		.shot = UINT64_MAX,
		.device_seq = camera->device_seq,
		.mid_exposure_ns = stamp.mid_exposure_ns,
		.uncertainty_ns = stamp.uncertainty_ns,
		.arrival_ns = stamp.arrival_ns,
		.token = (void *)(uintptr_t)buffer->index,
	};
}

static int v4l2_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;
	struct v4l2_filled buffer;
	int error = camera->lost;

	if (!error)
		error = take_buffer(camera, timeout_ns, &buffer);
	if (error == -ETIMEDOUT)
		return error;
	if (error) {
		camera->lost = error;
		return error;
	}
	count_frame(camera, buffer.sequence);
	if (!whole(camera, &buffer)) {
		camera->lost = v4l2_queue(&camera->device, buffer.index);
		return camera->lost ? camera->lost : -EBADMSG;
	}
	fill_frame(camera, &buffer, out);
	return 0;
}

/* A device that is gone may say so here first. */
static void v4l2_release(struct camera *base, struct frame *frame)
{
	struct v4l2_camera *camera = (struct v4l2_camera *)base;
	int error = v4l2_queue(&camera->device, (uint32_t)(uintptr_t)frame->token);

	if (!camera->lost)
		camera->lost = error;
	frame->pixels = NULL;
}

const struct camera_driver v4l2_camera_driver = {
	.name = "v4l2",
	.has_controls = true,
	.list = v4l2_list,
	.open = v4l2_open,
	.close = v4l2_close,
	.configure = v4l2_configure,
	.start = v4l2_start,
	.stop = v4l2_stop,
	.acquire = v4l2_acquire,
	.release = v4l2_release,
};
