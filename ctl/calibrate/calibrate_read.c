/*
 * Reader threads with a finder each. What they find is put in order afterwards, so that it does not
 * depend on them.
 */
#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "ctl/calibrate/calibrate_read.h"
#include "ctl/program_drivers.h"
#include "drivers/files/files.h"

#define PROGRESS_NS (100 * NS_PER_MS)

struct reading;

struct picture_reader {
	/* set before the thread starts */
	struct reading *reading;
	const struct camera_driver *driver;
	struct camera *camera;
	struct camera_mode mode;
	pthread_t thread;
	bool running;
	/* the thread's */
	struct view_search search;
	int err;
};

struct reading {
	const struct config *config;
	const struct board *board;
	const volatile sig_atomic_t *stop;
	struct picture_progress progress;
	_Atomic uint32_t running;
	sem_t permits;
	struct picture_reader readers[CAMERA_MAX];
};

static int search(struct picture_reader *r, const struct frame *frame)
{
	uint32_t good = r->search.counts.good;
	int err = view_search_run(&r->search, frame);

	r->reading->progress.with_board += r->search.counts.good - good;
	return err;
}

/* 0 while there may be more. */
static int read_picture(struct picture_reader *r)
{
	struct frame frame;
	int err = r->driver->acquire(r->camera, NS_PER_S, &frame);

	if (err == -ETIMEDOUT)
		return 0;
	if (err == -EBADMSG) {
		r->search.counts.damaged++;
		r->reading->progress.done++;
		return 0;
	}
	if (err)
		return err;
	err = search(r, &frame);
	r->driver->release(r->camera, &frame);
	r->reading->progress.done++;
	return err;
}

static void *read_camera(void *argument)
{
	struct picture_reader *r = argument;
	int err = 0;

	while (!err && !*r->reading->stop) {
		while (sem_wait(&r->reading->permits) < 0)
			; /* EINTR only */
		err = read_picture(r);
		sem_post(&r->reading->permits);
	}
	r->err = err == -ENODATA ? 0 : err;
	r->reading->running--;
	return NULL;
}

static int check_size(const struct config_camera *camera, const struct camera_mode *mode,
		      struct diag *diag)
{
	const struct camera_mode *wanted = &camera->wanted;

	if ((!wanted->width_px || wanted->width_px == mode->width_px) &&
	    (!wanted->height_px || wanted->height_px == mode->height_px))
		return 0;
	diag_add(diag,
		 "camera %s: its pictures are %dx%d, the config says %dx%d; record the board with "
		 "the size that the station uses, or correct width and height",
		 camera->name, mode->width_px, mode->height_px, wanted->width_px,
		 wanted->height_px);
	return -EINVAL;
}

static int open_reader(struct reading *reading, uint32_t index, struct diag *diag)
{
	const struct config_camera *camera = &reading->config->cameras[index];
	const struct view_search_settings settings = {reading->config->calibration.blur_max_px,
						      .thorough = true};
	struct picture_reader *r = &reading->readers[index];
	const char *rest;

	r->reading = reading;
	r->driver = camera_driver_find(recording_drivers, camera->address, &rest, diag);
	if (!r->driver)
		return -EINVAL;
	int err = r->driver->open(&r->camera, rest, reading->config->base_dir, diag);
	if (!err)
		err = r->driver->configure(r->camera, &camera->wanted, &r->mode, diag);
	if (!err)
		err = check_size(camera, &r->mode, diag);
	if (!err)
		err = r->driver->start(r->camera, diag);
	if (!err)
		err = view_search_init(&r->search, index, reading->board, &settings);
	r->search.counts.width_px = r->mode.width_px;
	r->search.counts.height_px = r->mode.height_px;
	reading->progress.of += err ? 0 : (uint32_t)files_camera_count(r->camera);
	return err;
}

static void close_reader(struct picture_reader *r)
{
	if (r->driver && r->camera) {
		r->driver->stop(r->camera);
		r->driver->close(r->camera);
	}
	view_search_finish(&r->search);
}

static int start_readers(struct reading *reading)
{
	long processors = sysconf(_SC_NPROCESSORS_ONLN);
	int err = 0;

	sem_init(&reading->permits, 0, processors > 0 ? (unsigned)processors : 1);
	for (uint32_t c = 0; c < reading->config->camera_count && !err; c++) {
		struct picture_reader *r = &reading->readers[c];

		reading->running++;
		err = -pthread_create(&r->thread, NULL, read_camera, r);
		r->running = !err;
		reading->running -= err != 0;
	}
	return err;
}

static int run(struct reading *reading, picture_progress_fn *progress, void *user,
	       struct diag *diag)
{
	const struct timespec nap = {.tv_nsec = PROGRESS_NS};
	int err = start_readers(reading);

	while (!err && reading->running) {
		nanosleep(&nap, NULL);
		progress(&reading->progress, user);
	}
	for (uint32_t c = 0; c < reading->config->camera_count; c++) {
		struct picture_reader *r = &reading->readers[c];

		if (r->running)
			pthread_join(r->thread, NULL);
		if (r->err) {
			diag_add(diag, "camera %s: %s", reading->config->cameras[c].name,
				 strerror(-r->err));
			err = r->err;
		}
	}
	sem_destroy(&reading->permits);
	return err;
}

static int init_observations(struct observations *o, const struct reading *reading,
			     struct diag *diag)
{
	const struct config *config = reading->config;
	struct observed_camera cameras[CAMERA_MAX];

	memset(cameras, 0, sizeof(cameras));
	for (uint32_t c = 0; c < config->camera_count; c++) {
		memcpy(cameras[c].name, config->cameras[c].name, NAME_BYTES);
		cameras[c].width_px = reading->readers[c].mode.width_px;
		cameras[c].height_px = reading->readers[c].mode.height_px;
	}
	return observations_init(o, reading->board, cameras, config->camera_count, diag);
}

int calibrate_read(struct observations *observations, struct picture_counts *counts,
		   const struct config *config, const struct board *board,
		   const volatile sig_atomic_t *stop, picture_progress_fn *progress, void *user,
		   struct diag *diag)
{
	struct reading *reading = calloc(1, sizeof(*reading));
	struct view_search *searches[CAMERA_MAX];
	struct observations made = {0};
	int err = 0;

	if (!reading)
		return -ENOMEM;
	reading->config = config;
	reading->board = board;
	reading->stop = stop;
	for (uint32_t c = 0; c < config->camera_count; c++) {
		int one = open_reader(reading, c, diag);

		searches[c] = &reading->readers[c].search;
		err = err ? err : one;
	}
	if (!err)
		err = run(reading, progress, user, diag);
	if (!err)
		err = init_observations(&made, reading, diag);
	if (!err)
		err = views_put_together(&made, searches, counts);
	if (err)
		observations_finish(&made);
	else
		*observations = made;
	for (uint32_t c = 0; c < config->camera_count; c++)
		close_reader(&reading->readers[c]);
	free(reading);
	return err;
}
