/*
 * The libcamera driver's frames. Buffers are mapped once and read where they are; only packed rows
 * and the luma of YUYV are unpacked into a picture of the driver's own. libcamera's thread hands
 * finished requests over through a ring; a thread of the driver queues the released ones again,
 * because libcamera locks and allocates there.
 */
#include "drivers/libcamera.h"

#include <assert.h>
#include <errno.h>
#include <linux/dma-buf.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/ring.h"
#include "drivers/libcamera_buffers.h"
#include "drivers/libcamera_device.h"
#include "drivers/libcamera_time.h"

#define THREAD_PRIORITY 55 /* above the capture threads, below the trigger */
#define LOOK_NS (400 * NS_PER_MS)
#define CANCELLED_MAX 64 /* one after another: the camera gives no pictures any more */

struct finished {
	struct libcamera_done done;
	int64_t arrival_ns;
};

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
	bool streams;
	pthread_t queue_thread;

	/* between the threads */
	struct ring arrived;  /* struct finished: libcamera's thread to the capture thread */
	struct ring released; /* uint32_t buffer: capture thread to the queueing one */
	sem_t ready;          /* arrived ones, and one post when the camera is gone */
	sem_t given;          /* released ones, and one post at the end */
	atomic_bool gone, ending;

	/* owned by libcamera's thread */
	bool realtime;

	/* owned by the capture thread */
	struct libcamera_timing timing;
	uint32_t cancelled; /* requests, one after another */
	bool counts;        /* a frame has come: */
	uint32_t last_sequence;
	uint64_t device_seq;
};

static void become_realtime(void)
{
	struct sched_param param = {.sched_priority = THREAD_PRIORITY};

	/* Where it is not allowed it works, with more jitter: doctor's business. */
	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
}

/* libcamera's thread. The ring holds all buffers: it is never full. */
static void on_done(void *user, const struct libcamera_done *done)
{
	struct libcamera_camera *camera = user;
	int64_t now_ns = clock_now_ns();

	if (!camera->realtime)
		become_realtime();
	camera->realtime = true;
	if (camera->ending)
		return;
	struct finished *finished = ring_claim(&camera->arrived);

	if (!finished)
		return;
	*finished = (struct finished){*done, now_ns};
	ring_publish(&camera->arrived);
	sem_post(&camera->ready);
}

/* libcamera's thread. */
static void on_gone(void *user)
{
	struct libcamera_camera *camera = user;

	camera->gone = true;
	sem_post(&camera->ready);
}

static int libcamera_open(struct camera **out, const char *rest, const char *base_dir,
			  struct diag *diag)
{
	struct libcamera_camera *camera = calloc(1, sizeof(*camera));
	int error = camera ? 0 : -ENOMEM;

	(void)base_dir;
	if (!error &&
	    (ring_init(&camera->arrived, sizeof(struct finished), LIBCAMERA_BUFFERS_MAX) ||
	     ring_init(&camera->released, sizeof(uint32_t), LIBCAMERA_BUFFERS_MAX)))
		error = -ENOMEM;
	if (error)
		diag_add(diag, "libcamera:%s: out of memory", rest);
	else
		error = libcamera_open_device(&camera->at, rest, diag);
	if (error)
		goto fail;
	camera->base.driver = &libcamera_camera_driver;
	sem_init(&camera->ready, 0, 0);
	sem_init(&camera->given, 0, 0);
	*out = &camera->base;
	return 0;
fail:
	if (camera) {
		ring_finish(&camera->arrived);
		ring_finish(&camera->released);
	}
	free(camera);
	return error;
}

static void libcamera_stop(struct camera *base);

static void libcamera_close(struct camera *base)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;

	if (!camera)
		return;
	libcamera_stop(base);
	libcamera_unmap_buffers(&camera->buffers);
	if (camera->gone)
		libcamera_shim_abandon(camera->at.device);
	else
		libcamera_shim_close(camera->at.device);
	sem_destroy(&camera->ready);
	sem_destroy(&camera->given);
	ring_finish(&camera->arrived);
	ring_finish(&camera->released);
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
	if (!error) {
		error = libcamera_map_buffers(camera->at.device, camera->stream.buffer_count,
					      least_bytes(camera), &camera->buffers);
		if (error)
			libcamera_fail(&camera->at, error, "buffers", diag);
	}
	if (!error)
		error = make_picture(camera, diag);
	if (error)
		return error;
	camera->timing = (struct libcamera_timing){
		.period_ns = camera->mode.period_ns ? camera->mode.period_ns : wanted->period_ns,
		.exposure_ns = camera->mode.exposure_ns,
		.readout_ns = wanted->readout_ns,
		.rows_ns = camera->mode.row_time_ns * (camera->mode.height_px - 1),
		.may_roll = camera->mode.shutter == SHUTTER_UNKNOWN,
		.boot_offset_ns = boot_offset_ns(),
	};
	*granted = camera->mode;
	return 0;
}

/* Of what libcamera sets up only USB cameras are told to be gone: the others' sensors are looked
 * for. */
static void look_for_sensor(struct libcamera_camera *camera)
{
	if (*camera->at.sensor && access(camera->at.sensor, F_OK))
		on_gone(camera);
}

/* Also after a while in which nothing was given. */
static void wait_given(struct libcamera_camera *camera)
{
	int64_t until_ns = clock_now_ns() + LOOK_NS;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	while (sem_clockwait(&camera->given, CLOCK_MONOTONIC, &until))
		if (errno == ETIMEDOUT) {
			look_for_sensor(camera);
			return;
		}
}

/* The driver's thread: gives the camera the buffers that the capture thread is done with. */
static void *queue_released(void *user)
{
	struct libcamera_camera *camera = user;

	pthread_setname_np(pthread_self(), "libcamera-queue");
	become_realtime();
	while (!camera->ending) {
		uint32_t *buffer = ring_peek(&camera->released, 0);

		if (!buffer || camera->gone) {
			wait_given(camera);
			continue;
		}
		libcamera_shim_queue(camera->at.device, *buffer);
		ring_pop(&camera->released);
	}
	return NULL;
}

static void forget_stream(struct libcamera_camera *camera)
{
	ring_clear(&camera->arrived);
	ring_clear(&camera->released);
	while (sem_trywait(&camera->ready) == 0 || sem_trywait(&camera->given) == 0)
		;
	camera->ending = false;
	camera->cancelled = 0;
	camera->counts = false;
	camera->device_seq = 0;
}

static int libcamera_start(struct camera *base, struct diag *diag)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;
	struct libcamera_hooks hooks = {on_done, on_gone, camera};
	int error = camera->gone ? -ENODEV : 0;

	assert(camera->buffers.count && !camera->streams);
	forget_stream(camera);
	libcamera_time_begin(&camera->timing, clock_now_ns());
	if (!error)
		error = -pthread_create(&camera->queue_thread, NULL, queue_released, camera);
	if (error)
		return libcamera_fail(&camera->at, error, "start", diag);
	camera->streams = true;
	error = libcamera_shim_start(camera->at.device, &camera->light, &hooks);
	if (!error)
		return 0;
	libcamera_stop(base);
	return libcamera_fail(&camera->at, error, "start", diag);
}

static void libcamera_stop(struct camera *base)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;

	if (!camera->streams)
		return;
	camera->ending = true;
	sem_post(&camera->given);
	pthread_join(camera->queue_thread, NULL);
	look_for_sensor(camera);
	if (!camera->gone)
		libcamera_shim_stop(camera->at.device);
	camera->streams = false;
}

static int wait_ready(struct libcamera_camera *camera, int64_t timeout_ns)
{
	int64_t until_ns = clock_now_ns() + timeout_ns;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	while (sem_clockwait(&camera->ready, CLOCK_MONOTONIC, &until))
		if (errno != EINTR)
			return -errno;
	return 0;
}

static void give_back(struct libcamera_camera *camera, uint32_t buffer)
{
	uint32_t *item = ring_claim(&camera->released); /* never full: it holds all buffers */

	if (!item)
		return;
	*item = buffer;
	ring_publish(&camera->released);
	sem_post(&camera->given);
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

static void unpack(const struct libcamera_camera *camera, const uint8_t *pixels)
{
	int width_px = camera->mode.width_px;
	size_t row_bytes = pixel_row_bytes(camera->mode.format, width_px);

	for (int y = 0; y < camera->mode.height_px; y++)
		libcamera_unpack_row(camera->format->packing,
				     pixels + (size_t)y * (size_t)camera->stream.stride_bytes,
				     camera->picture + (size_t)y * row_bytes, width_px);
}

static void fill_frame(struct libcamera_camera *camera, const struct finished *finished,
		       struct frame *out)
{
	const struct libcamera_done *done = &finished->done;
	const uint8_t *pixels = camera->buffers.buffers[done->buffer].pixels;
	bool compressed = camera->mode.format == PIXEL_MJPEG;
	struct libcamera_stamp stamp = {done->stamp_ns, done->exposure_ns, finished->arrival_ns, 0,
					0};

	libcamera_time(&camera->timing, &stamp);
	libcamera_sync_buffer(&camera->buffers, done->buffer, DMA_BUF_SYNC_START);
	if (camera->picture)
		unpack(camera, pixels);
	*out = (struct frame){
		.pixels = camera->picture ? camera->picture : pixels,
		.width_px = camera->mode.width_px,
		.height_px = camera->mode.height_px,
		.stride_bytes = camera->picture ? (int)pixel_row_bytes(camera->mode.format,
								       camera->mode.width_px)
				: compressed    ? 0
						: camera->stream.stride_bytes,
		.format = camera->mode.format,
		.bits = camera->mode.bits,
		.size_bytes = compressed ? done->used_bytes : 0,
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
	int error = wait_ready(camera, timeout_ns);
	struct finished *item = ring_peek(&camera->arrived, 0);

	if (camera->gone)
		return -ENODEV;
	if (!item)
		return error ? error : -ETIMEDOUT;
	struct finished finished = *item;

	ring_pop(&camera->arrived);
	camera->cancelled = finished.done.end == LIBCAMERA_CANCELLED ? camera->cancelled + 1 : 0;
	if (camera->cancelled > CANCELLED_MAX)
		return -EIO;
	if (finished.done.end != LIBCAMERA_CANCELLED)
		count_frame(camera, finished.done.sequence);
	if (!whole(camera, &finished.done)) {
		give_back(camera, finished.done.buffer);
		return -EBADMSG;
	}
	fill_frame(camera, &finished, out);
	return 0;
}

static void libcamera_release(struct camera *base, struct frame *frame)
{
	struct libcamera_camera *camera = (struct libcamera_camera *)base;
	uint32_t buffer = (uint32_t)(uintptr_t)frame->token;

	libcamera_sync_buffer(&camera->buffers, buffer, DMA_BUF_SYNC_END);
	give_back(camera, buffer);
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
