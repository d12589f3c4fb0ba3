/*
 * Buffers are files in memory, mapped here and by the driver.
 */
#include "tests/contract/fake_libcamera.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"

#define BUFFERS 6
#define PERIOD_NS (10 * NS_PER_MS)
#define EXPOSURE_NS (2 * NS_PER_MS)

struct libcamera_device {
	size_t size_bytes;
	int fds[BUFFERS];
	uint8_t *pixels[BUFFERS];
	struct libcamera_stream stream;
	struct libcamera_hooks hooks;
	pthread_t thread;
	bool runs;
	pthread_mutex_t lock; /* around all below */
	bool ending;
	uint32_t queued[BUFFERS];
	int queued_count;
	uint32_t sequence;
};

struct fake_libcamera fake;
static struct libcamera_device *the_device;

void fake_libcamera_begin(void)
{
	fake = (struct fake_libcamera){.id = FAKE_ID,
				       .model = "ov9281",
				       .formats = {"R8"},
				       .width_px = 64,
				       .height_px = 48,
				       .stride_bytes = 80,
				       .low = {20, 1, 9000},
				       .high = {8000, 16, 1e6},
				       .readout_ns = 3 * NS_PER_MS};
}

void fake_libcamera_unplug(void)
{
	fake.unseen = true;
	the_device->hooks.gone(the_device->hooks.user);
}

uint8_t *fake_libcamera_pixels(uint32_t buffer)
{
	return the_device->pixels[buffer];
}

int libcamera_shim_hold(void)
{
	return 0;
}

void libcamera_shim_let_go(void) {}

int libcamera_shim_list(libcamera_found_fn *found, void *user)
{
	if (!fake.unseen)
		found(fake.id, fake.model, user);
	return fake.unseen ? 0 : 1;
}

int libcamera_shim_open(struct libcamera_device **out, const char *id)
{
	if (fake.unseen || strcmp(id, fake.id) != 0)
		return -ENODEV;
	if (fake.busy)
		return -EBUSY;
	*out = the_device = calloc(1, sizeof(*the_device));
	assert(the_device);
	pthread_mutex_init(&the_device->lock, NULL);
	return 0;
}

static void drop_buffers(struct libcamera_device *device)
{
	for (int b = 0; b < BUFFERS && device->size_bytes; b++) {
		munmap(device->pixels[b], device->size_bytes);
		close(device->fds[b]);
	}
	device->size_bytes = 0;
}

void libcamera_shim_close(struct libcamera_device *device)
{
	assert(!device->runs);
	fake.closes++;
	drop_buffers(device);
	free(device);
}

static void end_thread(struct libcamera_device *device)
{
	pthread_mutex_lock(&device->lock);
	device->ending = true;
	pthread_mutex_unlock(&device->lock);
	if (device->runs)
		pthread_join(device->thread, NULL);
	device->runs = false;
}

void libcamera_shim_abandon(struct libcamera_device *device)
{
	fake.abandons++;
	end_thread(device);
	drop_buffers(device);
	free(device);
}

const char *libcamera_shim_model(const struct libcamera_device *device)
{
	(void)device;
	return fake.model;
}

void libcamera_shim_offers(struct libcamera_device *device, libcamera_offer_fn *offer, void *user)
{
	(void)device;
	for (int f = 0; f < FAKE_FORMATS && fake.formats[f]; f++)
		offer(!fake.processed, fake.formats[f], fake.width_px, fake.height_px, user);
}

int libcamera_shim_configure(struct libcamera_device *device, struct libcamera_stream *stream)
{
	bool other = (stream->width_px && stream->width_px != fake.width_px) ||
		     (stream->height_px && stream->height_px != fake.height_px);

	drop_buffers(device);
	stream->width_px = fake.width_px;
	stream->height_px = fake.height_px;
	stream->stride_bytes = fake.stride_bytes;
	stream->buffer_count = BUFFERS;
	if (other)
		return 0;
	device->stream = *stream;
	device->size_bytes = (size_t)fake.stride_bytes * (size_t)fake.height_px;
	for (int b = 0; b < BUFFERS; b++) {
		device->fds[b] = memfd_create("fake", MFD_CLOEXEC);
		assert(ftruncate(device->fds[b], (off_t)device->size_bytes) == 0);
		device->pixels[b] = mmap(NULL, device->size_bytes, PROT_READ | PROT_WRITE,
					 MAP_SHARED, device->fds[b], 0);
		assert(device->pixels[b] != MAP_FAILED);
	}
	return 0;
}

struct libcamera_plane libcamera_shim_plane(const struct libcamera_device *device, uint32_t buffer)
{
	return (struct libcamera_plane){device->fds[buffer], 0, device->size_bytes};
}

bool libcamera_shim_range(const struct libcamera_device *device, enum libcamera_setting setting,
			  double *low, double *high)
{
	(void)device;
	if (!fake.high[setting])
		return false;
	*low = fake.low[setting];
	*high = fake.high[setting];
	return true;
}

static void paint(const struct libcamera_device *device, uint32_t buffer, uint32_t sequence)
{
	for (int y = 0; y < fake.height_px; y++)
		for (int i = 0; i < fake.stride_bytes; i++)
			device->pixels[buffer][y * fake.stride_bytes + i] =
				(uint8_t)((int)sequence + y + i);
	if (strcmp(device->stream.format, "MJPEG") == 0)
		memcpy(device->pixels[buffer], "\xff\xd8", 2);
}

/* A buffer to fill, or -1. */
static int take_queued(struct libcamera_device *device)
{
	int buffer = -1;

	pthread_mutex_lock(&device->lock);
	if (device->queued_count > 0) {
		buffer = (int)device->queued[0];
		device->queued_count--;
		memmove(device->queued, device->queued + 1,
			(size_t)device->queued_count * sizeof(device->queued[0]));
	}
	pthread_mutex_unlock(&device->lock);
	return buffer;
}

static bool every(uint32_t interval, uint32_t sequence)
{
	return interval && sequence % interval == interval - 1;
}

static int64_t exposure_ns(void)
{
	double told_us = fake.light.values[LIBCAMERA_EXPOSURE_US];

	return told_us > 0 ? (int64_t)(told_us * NS_PER_US) : EXPOSURE_NS;
}

/* Exposes now, ends with the picture's arrival. */
static void make_frame(struct libcamera_device *device, uint32_t sequence)
{
	int64_t begin_ns = clock_now_ns(), end_ns = begin_ns + exposure_ns();
	int64_t done_ns = end_ns + fake.readout_ns;
	int buffer = every(fake.lose_every, sequence) ? -1 : take_queued(device);
	struct libcamera_done done = {.sequence = sequence, .used_bytes = device->size_bytes};

	fake.truth_ns[sequence % FAKE_TRUTHS] = begin_ns + exposure_ns() / 2 + fake.rows_ns / 2;
	clock_sleep_until(done_ns);
	if (buffer < 0)
		return;
	paint(device, (uint32_t)buffer, sequence);
	done.buffer = (uint32_t)buffer;
	done.end = fake.cancels                         ? LIBCAMERA_CANCELLED
		   : every(fake.damage_every, sequence) ? LIBCAMERA_DAMAGED
							: LIBCAMERA_WHOLE;
	done.stamp_ns = fake.stamp_offset_ns + (fake.stamps_exposure ? begin_ns
						: fake.stamps_end    ? done_ns
								     : end_ns);
	device->hooks.done(device->hooks.user, &done);
}

static void *run(void *user)
{
	struct libcamera_device *device = user;
	int64_t next_ns = clock_now_ns();
	bool ending;

	do {
		make_frame(device, device->sequence++);
		next_ns += fake.cancels ? NS_PER_MS : PERIOD_NS;
		clock_sleep_until(next_ns);
		pthread_mutex_lock(&device->lock);
		ending = device->ending;
		pthread_mutex_unlock(&device->lock);
	} while (!ending);
	return NULL;
}

int libcamera_shim_start(struct libcamera_device *device, const struct libcamera_light *light,
			 const struct libcamera_hooks *hooks)
{
	fake.light = *light;
	device->hooks = *hooks;
	device->ending = false;
	device->queued_count = 0;
	device->sequence = 0;
	for (uint32_t b = 0; b < BUFFERS; b++)
		device->queued[device->queued_count++] = b;
	device->runs = pthread_create(&device->thread, NULL, run, device) == 0;
	return device->runs ? 0 : -EAGAIN;
}

void libcamera_shim_stop(struct libcamera_device *device)
{
	fake.stops++;
	end_thread(device);
}

int libcamera_shim_queue(struct libcamera_device *device, uint32_t buffer)
{
	pthread_mutex_lock(&device->lock);
	assert(device->queued_count < BUFFERS);
	device->queued[device->queued_count++] = buffer;
	pthread_mutex_unlock(&device->lock);
	return 0;
}
