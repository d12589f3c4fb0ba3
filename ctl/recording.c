/*
 * Reader threads: each fills a ring of its own. `permits` bounds how many work at once; a reader
 * holds one only while it reads and searches, never while it waits for room in its ring.
 */
#include "ctl/recording.h"

#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/ring.h"
#include "drivers/frame_image.h"

#define READ_AHEAD 8
#define ACQUIRE_TIMEOUT_NS NS_PER_S

struct reader {
	/* set before the thread starts */
	struct recording *recording;
	struct open_camera *camera;
	struct blob_finder *finder;
	pthread_t thread;
	bool running;

	/* both threads */
	struct ring ring;
	sem_t filled; /* sets in the ring, and one more when the recording is over */
	sem_t room;

	/* the reader's; the caller reads it after `ended` */
	struct recording_losses losses;

	/* the caller's */
	bool peeked, ended;
};

struct recording {
	sem_t permits;
	_Atomic bool stopping;
	uint32_t camera_count;
	struct reader readers[CAMERA_MAX];
};

static void sem_take(sem_t *sem)
{
	while (sem_wait(sem) < 0)
		; /* EINTR only */
}

static void fill_set(struct blob_set *set, const struct frame *frame)
{
	set->shot = frame->shot;
	set->device_seq = frame->device_seq;
	set->mid_exposure_ns = frame->mid_exposure_ns;
	set->uncertainty_ns = frame->uncertainty_ns;
	set->arrival_ns = frame->arrival_ns;
	set->found_ns = frame->arrival_ns;
}

/* 1 when `set` was filled, 0 when a frame was damaged, negative when there are no more. */
static int read_set(struct reader *reader, struct blob_set *set)
{
	const struct camera_driver *driver = reader->camera->driver;
	const struct camera_mode *mode = &reader->camera->granted;
	struct frame frame;
	int err = driver->acquire(reader->camera->camera, ACQUIRE_TIMEOUT_NS, &frame);

	if (err == -ETIMEDOUT)
		return 0;
	if (err == -EBADMSG)
		reader->losses.damaged++;
	if (err && err != -EBADMSG && err != -ENODATA)
		reader->losses.error = err;
	if (err)
		return err == -EBADMSG ? 0 : err;
	bool whole = frame.width_px == mode->width_px && frame.height_px == mode->height_px &&
		     pixels_are_grey(frame.format);
	if (whole) {
		struct grey_image image = frame_grey_image(&frame);

		fill_set(set, &frame);
		blob_finder_run(reader->finder, &image, set);
		reader->losses.blobs_lost += set->blobs_lost;
	}
	reader->losses.frames += whole;
	reader->losses.damaged += !whole;
	driver->release(reader->camera->camera, &frame);
	return whole;
}

static void *read_camera(void *argument)
{
	struct reader *reader = argument;
	struct recording *recording = reader->recording;
	int got = 0;

	while (got >= 0) {
		sem_take(&reader->room);
		struct blob_set *set = ring_claim(&reader->ring);
		for (got = 0; got == 0 && !atomic_load(&recording->stopping);) {
			sem_take(&recording->permits);
			got = read_set(reader, set);
			sem_post(&recording->permits);
		}
		if (got <= 0)
			break; /* over, broken or stopping */
		ring_publish(&reader->ring);
		sem_post(&reader->filled);
	}
	sem_post(&reader->filled);
	return NULL;
}

/* More threads than cameras do not help; a semaphore has its own limit. */
static unsigned permits_of(uint32_t thread_count)
{
	return thread_count < 1 ? 1 : thread_count > CAMERA_MAX ? CAMERA_MAX : thread_count;
}

static int start_reader(struct recording *recording, uint32_t index, const struct stage *stage,
			struct open_camera *camera, struct diag *diag)
{
	struct reader *reader = &recording->readers[index];
	struct blob_settings blobs = config_blobs(&stage->config, index);

	reader->recording = recording;
	reader->camera = camera;
	int err = blob_finder_create(&reader->finder, camera->granted.width_px,
				     camera->granted.height_px, &blobs);
	if (!err)
		err = ring_init(&reader->ring, sizeof(struct blob_set), READ_AHEAD);
	if (err) {
		diag_add(diag, "camera %s: out of memory", stage->config.cameras[index].name);
		return err;
	}
	err = camera->driver->start(camera->camera, diag);
	if (err)
		return err;
	err = -pthread_create(&reader->thread, NULL, read_camera, reader);
	if (err) {
		diag_add(diag, "camera %s: cannot start a thread: %s",
			 stage->config.cameras[index].name, strerror(-err));
		camera->driver->stop(camera->camera);
		return err;
	}
	reader->running = true;
	return 0;
}

int recording_open(struct recording **out, const struct stage *stage, struct open_camera *cameras,
		   uint32_t thread_count, struct diag *diag)
{
	struct recording *recording = calloc(1, sizeof(*recording));
	int err = 0;

	if (!recording)
		return -ENOMEM;
	recording->camera_count = stage->config.camera_count;
	sem_init(&recording->permits, 0, permits_of(thread_count));
	for (uint32_t c = 0; c < recording->camera_count; c++) {
		sem_init(&recording->readers[c].filled, 0, 0);
		sem_init(&recording->readers[c].room, 0, READ_AHEAD);
	}
	for (uint32_t c = 0; c < recording->camera_count && !err; c++)
		if (cameras[c].camera)
			err = start_reader(recording, c, stage, &cameras[c], diag);
	if (err) {
		recording_close(recording);
		return err;
	}
	*out = recording;
	return 0;
}

static void stop_reader(struct reader *reader)
{
	if (reader->running) {
		sem_post(&reader->room);
		pthread_join(reader->thread, NULL);
		reader->camera->driver->stop(reader->camera->camera);
	}
	blob_finder_destroy(reader->finder);
	ring_finish(&reader->ring);
	sem_destroy(&reader->filled);
	sem_destroy(&reader->room);
}

void recording_close(struct recording *recording)
{
	if (!recording)
		return;
	atomic_store(&recording->stopping, true);
	for (uint32_t c = 0; c < recording->camera_count; c++)
		stop_reader(&recording->readers[c]);
	sem_destroy(&recording->permits);
	free(recording);
}

const struct blob_set *recording_peek(struct recording *recording, uint32_t camera)
{
	struct reader *reader = &recording->readers[camera];

	if (!reader->running || reader->ended)
		return NULL;
	if (!reader->peeked)
		sem_take(&reader->filled);
	reader->peeked = true;
	const struct blob_set *set = ring_peek(&reader->ring, 0);
	reader->ended = !set;
	return set;
}

void recording_pop(struct recording *recording, uint32_t camera)
{
	struct reader *reader = &recording->readers[camera];

	ring_pop(&reader->ring);
	reader->peeked = false;
	sem_post(&reader->room);
}

struct recording_losses recording_losses(const struct recording *recording, uint32_t camera)
{
	return recording->readers[camera].losses;
}
