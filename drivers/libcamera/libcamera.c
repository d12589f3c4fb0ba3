/*
 * The libcamera driver's frames. Buffers are mapped once and read where they are; only packed rows
 * and the luma of YUYV are unpacked into a picture of the driver's own.
 */
#include "drivers/libcamera/libcamera.h"

#include <assert.h>
#include <errno.h>
#include <linux/dma-buf.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera_buffers.h"
#include "drivers/libcamera/libcamera_flow.h"
#include "drivers/libcamera/libcamera_time.h"

#define CANCELLED_MAX 64 /* one after another: the camera gives no pictures any more */

struct libcamera_camera {
	struct camera base;

	/* set before the stream starts */
	struct libcamera_at at;
	struct camera_mode mode;
	struct libcamera_stream stream;
	const struct libcamera_format *format;
	struct libcamera_light light;
	struct libcamera_buffers buffers;
	uint8_t *picture; /* owned; NULL where frames are read in place */

	struct libcamera_flow flow; /* between the threads */

	/* owned by the capture thread */
	struct libcamera_timing timing;
	uint32_t cancelled; /* requests, one after another */
	bool counts;        /* a frame has come: */
	uint32_t last_sequence;
	uint64_t device_seq;
};

static int libcamera_open(struct camera **out, const char *rest, const char *base_dir,
			  struct diag *diag)
{
	struct libcamera_camera *camera = calloc(1, sizeof(*camera));
	int error;

	(void)base_dir;
	if (!camera || libcamera_flow_init(&camera->flow, &camera->at)) {
		diag_add(diag, "libcamera:%s: out of memory", rest);
		free(camera);
		return -ENOMEM;
	}
	camera->base.driver = &libcamera_camera_driver;
	error = libcamera_open_device(&camera->at, rest, diag);
	if (error) {
		libcamera_flow_finish(&camera->flow);
		free(camera);
		return error;
	}
	*out = &camera->base;
	return 0;
}

static void libcamera_stop(struct camera *base)
{
	libcamera_flow_stop(&((struct libcamera_camera *)base)->flow);
}

static void libcamera_close(struct camera *base)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;

	if (!camera)
		return;
	libcamera_stop(base);
	libcamera_unmap_buffers(&camera->buffers);
	if (camera->flow.gone)
		libcamera_shim_abandon(camera->at.device);
	else
		libcamera_shim_close(camera->at.device);
	libcamera_flow_finish(&camera->flow);
	free(camera->picture);
	free(camera);
}

static int make_picture(struct libcamera_camera *camera, struct diag *diag)
{
	size_t row_bytes = pixel_row_bytes(camera->mode.format, camera->mode.width_px);
	size_t size_bytes = row_bytes * (size_t)camera->mode.height_px;

	free(camera->picture);
	camera->picture = NULL;
	if (camera->format->packing == PACKING_NONE)
		return 0;
	camera->picture = malloc(size_bytes);
	if (!camera->picture)
		return libcamera_fail(&camera->at, -ENOMEM, "buffers", diag);
	memset(camera->picture, 0, size_bytes); /* every page is there now */
	return 0;
}

/* Bytes that a buffer must have. */
static size_t least_bytes(const struct libcamera_camera *camera)
{
	if (camera->mode.format == PIXEL_MJPEG)
		return 0;
	return (size_t)camera->stream.stride_bytes * (size_t)(camera->mode.height_px - 1) +
	       libcamera_packed_row_bytes(camera->format, camera->mode.width_px);
}

static int make_buffers(struct libcamera_camera *camera, struct diag *diag)
{
	int error = libcamera_map_buffers(camera->at.device, camera->stream.buffer_count,
					  least_bytes(camera), &camera->buffers);

	return error ? libcamera_fail(&camera->at, error, "buffers", diag)
		     : make_picture(camera, diag);
}

/* Of the two clocks: they part when the computer sleeps. */
static int64_t boot_offset_ns(void)
{
	struct timespec boot;

	clock_gettime(CLOCK_BOOTTIME, &boot);
	return boot.tv_sec * NS_PER_S + boot.tv_nsec - clock_now_ns();
}

static int libcamera_configure(struct camera *base, const struct camera_mode *wanted,
			       struct camera_mode *granted, struct diag *diag)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;
	int error;

	libcamera_unmap_buffers(&camera->buffers);
	error = libcamera_configure_device(&camera->at, wanted, &camera->mode, &camera->stream,
					   &camera->format, &camera->light, diag);
	if (!error)
		error = make_buffers(camera, diag);
	if (error)
		return error;
	camera->timing = (struct libcamera_timing){
		.period_ns = camera->mode.period_ns,
		.exposure_ns = camera->mode.exposure_ns,
		.readout_ns = wanted->readout_ns,
		.rows_ns = camera->mode.row_time_ns * (camera->mode.height_px - 1),
		.may_roll = camera->mode.shutter == SHUTTER_UNKNOWN,
		.boot_offset_ns = boot_offset_ns(),
	};
	*granted = camera->mode;
	return 0;
}

static int libcamera_start(struct camera *base, struct diag *diag)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;
	int error;

	assert(camera->buffers.count && !camera->flow.streams);
	camera->cancelled = 0;
	camera->counts = false;
	camera->device_seq = 0;
	libcamera_time_begin(&camera->timing, clock_now_ns());
	error = libcamera_flow_start(&camera->flow, &camera->light);
	return error ? libcamera_fail(&camera->at, error, "start", diag) : 0;
}

/* A device whose sequence stands still, or runs back, does not count: then its frames are. */
static void count_frame(struct libcamera_camera *camera, uint32_t sequence)
{
	uint32_t step = sequence - camera->last_sequence;

	camera->device_seq += !camera->counts ? sequence : step == 0 || step > INT32_MAX ? 1 : step;
	camera->counts = true;
	camera->last_sequence = sequence;
}

static bool whole(const struct libcamera_camera *camera, const struct libcamera_done *done)
{
	const struct libcamera_buffer *buffer = &camera->buffers.buffers[done->buffer];

	if (done->end != LIBCAMERA_WHOLE || done->used_bytes > buffer->size_bytes)
		return false;
	if (camera->mode.format == PIXEL_MJPEG) /* begins as every JPEG */
		return done->used_bytes > 4 && buffer->pixels[0] == 0xff &&
		       buffer->pixels[1] == 0xd8;
	return done->used_bytes == 0 || done->used_bytes >= least_bytes(camera);
}

static void give_back(struct libcamera_camera *camera, uint32_t buffer)
{
	libcamera_sync_buffer(&camera->buffers, buffer, DMA_BUF_SYNC_END);
	libcamera_flow_give(&camera->flow, buffer);
}

static void unpack(const struct libcamera_camera *camera, const uint8_t *pixels)
{
	int width_px = camera->mode.width_px;
	size_t row_bytes = pixel_row_bytes(camera->mode.format, width_px);

	for (int y = 0; y < camera->mode.height_px; y++)
		libcamera_unpack_row(camera->format->packing,
				     pixels + (size_t)y * (size_t)camera->stream.stride_bytes,
				     camera->picture + (size_t)y * row_bytes, width_px);
}

static int stride_bytes(const struct libcamera_camera *camera)
{
	if (camera->picture)
		return (int)pixel_row_bytes(camera->mode.format, camera->mode.width_px);
	return camera->mode.format == PIXEL_MJPEG ? 0 : camera->stream.stride_bytes;
}

static void fill_frame(struct libcamera_camera *camera, const struct libcamera_finished *finished,
		       struct frame *out)
{
	const struct libcamera_done *done = &finished->done;
	const uint8_t *pixels = camera->buffers.buffers[done->buffer].pixels;
	struct libcamera_stamp stamp = {.stamp_ns = done->stamp_ns,
					.exposure_ns = done->exposure_ns,
					.arrival_ns = finished->arrival_ns};

	libcamera_time(&camera->timing, &stamp);
	if (camera->picture)
		unpack(camera, pixels);
	*out = (struct frame){
		.pixels = camera->picture ? camera->picture : pixels,
		.width_px = camera->mode.width_px,
		.height_px = camera->mode.height_px,
		.stride_bytes = stride_bytes(camera),
		.format = camera->mode.format,
		.bits = camera->mode.bits,
		.size_bytes = camera->mode.format == PIXEL_MJPEG ? done->used_bytes : 0,
		.shot = UINT64_MAX,
		.device_seq = camera->device_seq,
		.mid_exposure_ns = stamp.mid_exposure_ns,
		.uncertainty_ns = stamp.uncertainty_ns,
		.arrival_ns = stamp.arrival_ns,
		.row_time_ns = camera->mode.row_time_ns,
		.token = (void *)(uintptr_t)done->buffer,
	};
}

static int libcamera_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;
	struct libcamera_finished finished;
	int error = libcamera_flow_wait(&camera->flow, timeout_ns, &finished);
	bool cancelled = !error && finished.done.end == LIBCAMERA_CANCELLED;

	if (error)
		return error;
	camera->cancelled = cancelled ? camera->cancelled + 1 : 0;
	if (camera->cancelled > CANCELLED_MAX)
		return -EIO;
	if (!cancelled)
		count_frame(camera, finished.done.sequence);
	libcamera_sync_buffer(&camera->buffers, finished.done.buffer, DMA_BUF_SYNC_START);
	if (!whole(camera, &finished.done)) {
		give_back(camera, finished.done.buffer);
		return -EBADMSG;
	}
	fill_frame(camera, &finished, out);
	return 0;
}

static void libcamera_release(struct camera *base, struct frame *frame)
{
	give_back((struct libcamera_camera *)base, (uint32_t)(uintptr_t)frame->token);
	frame->pixels = NULL;
}

const struct camera_driver libcamera_camera_driver = {
	.name = "libcamera",
	.has_controls = true,
	.list = libcamera_list,
	.open = libcamera_open,
	.close = libcamera_close,
	.configure = libcamera_configure,
	.start = libcamera_start,
	.stop = libcamera_stop,
	.acquire = libcamera_acquire,
	.release = libcamera_release,
};
