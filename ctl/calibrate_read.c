/*
 * Reader threads with a finder each. What they find is put in order afterwards, so that it does not
 * depend on them.
 */
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <semaphore.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "ctl/calibrate_read.h"
#include "ctl/demosaic.h"
#include "ctl/program_drivers.h"
#include "drivers/files.h"

#define PROGRESS_NS (100 * NS_PER_MS)
#define TOGETHER_NS (200 * NS_PER_US) /* cameras whose middles of exposure differ by less */
#define MIRROR_TRIES 3

/* A board that one camera saw. */
struct found {
	uint32_t camera;
	uint64_t shot;
	int64_t mid_exposure_ns;
	double (*px)[2]; /* owned */
};

struct reading;

struct picture_reader {
	/* set before the thread starts */
	struct reading *reading;
	uint32_t index;
	const struct camera_driver *driver;
	struct camera *camera;
	struct camera_mode mode;
	struct corner_finder *finder;
	pthread_t thread;
	bool running;
	/* the thread's */
	uint8_t *grey, *rgb; /* owned; NULL until an HD picture comes */
	struct corners corners;
	struct found *found; /* owned */
	uint32_t found_count, found_capacity;
	double *blurs_px; /* owned */
	uint32_t blur_count, blur_capacity;
	struct picture_counts counts;
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

static int grow(void **list, uint32_t *capacity, uint32_t count, size_t item_bytes)
{
	if (count < *capacity)
		return 0;
	uint32_t wanted = *capacity ? 2 * *capacity : 64;
	void *larger = realloc(*list, wanted * item_bytes);
	if (!larger)
		return -ENOMEM;
	*list = larger;
	*capacity = wanted;
	return 0;
}

static int keep_blur(struct picture_reader *r)
{
	int err = grow((void **)&r->blurs_px, &r->blur_capacity, r->blur_count, sizeof(double));

	if (!err)
		r->blurs_px[r->blur_count++] = r->corners.blur_px;
	return err;
}

static int keep_view(struct picture_reader *r, const struct frame *frame)
{
	size_t bytes = (size_t)board_corner_count(r->reading->board) * sizeof(double[2]);
	int err =
		grow((void **)&r->found, &r->found_capacity, r->found_count, sizeof(struct found));
	double(*px)[2] = err ? NULL : malloc(bytes);

	if (!px)
		return -ENOMEM;
	memcpy(px, r->corners.px, bytes);
	r->found[r->found_count++] =
		(struct found){r->index, frame->shot, frame->mid_exposure_ns, px};
	return 0;
}

/* BT.601 luma, as for files that are made grey. */
static void rgb_to_grey(const uint8_t *rgb, uint8_t *grey, size_t count)
{
	for (size_t i = 0; i < count; i++, rgb += 3)
		grey[i] = (uint8_t)((299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2] + 500) / 1000);
}

static int to_grey(struct picture_reader *r, const struct frame *frame, struct grey_image *image)
{
	size_t count = (size_t)frame->width_px * (size_t)frame->height_px;
	const uint8_t *rgb = frame->pixels;

	*image = (struct grey_image){frame->pixels, frame->width_px, frame->height_px,
				     frame->stride_bytes};
	if (frame->format == PIXEL_GREY8)
		return 0;
	if (!r->grey) {
		r->grey = malloc(count);
		r->rgb = malloc(3 * count);
	}
	if (!r->grey || !r->rgb)
		return -ENOMEM;
	if (frame->format == PIXEL_BAYER_RG8) {
		demosaic(frame->pixels, frame->width_px, frame->height_px, PIXEL_BAYER_RG8, r->rgb);
		rgb = r->rgb;
	}
	rgb_to_grey(rgb, r->grey, count);
	*image = (struct grey_image){r->grey, frame->width_px, frame->height_px, frame->width_px};
	return 0;
}

/* Of a camera that has not seen the board yet. */
static int look_in_mirror(struct picture_reader *r, const struct grey_image *image)
{
	if (r->counts.good || r->counts.without > MIRROR_TRIES || r->counts.mirrored)
		return 0;
	return corner_finder_is_mirrored(r->finder, image, &r->counts.mirrored);
}

static int sort_picture(struct picture_reader *r, const struct frame *frame,
			const struct grey_image *image)
{
	int err = 0;

	r->counts.pictures++;
	switch (r->corners.state) {
	case CORNERS_GOOD:
		r->counts.good++;
		r->reading->progress.with_board++;
		err = keep_blur(r);
		return err ? err : keep_view(r, frame);
	case CORNERS_NO_BOARD:
		r->counts.without++;
		return look_in_mirror(r, image);
	case CORNERS_FEW:
		r->counts.few++;
		return 0;
	case CORNERS_BLURRED:
		r->counts.blurred++;
		return keep_blur(r);
	case CORNERS_OTHER_BOARD:
		r->counts.other++;
		return 0;
	}
	return 0;
}

static int search(struct picture_reader *r, const struct frame *frame)
{
	struct grey_image image;

	if (frame->width_px != r->mode.width_px || frame->height_px != r->mode.height_px) {
		r->counts.damaged++;
		return 0;
	}
	int err = to_grey(r, frame, &image);
	if (!err)
		err = corner_finder_run(r->finder, &image, &r->corners);
	return err ? err : sort_picture(r, frame, &image);
}

/* 0 while there may be more. */
static int read_picture(struct picture_reader *r)
{
	struct frame frame;
	int err = r->driver->acquire(r->camera, NS_PER_S, &frame);

	if (err == -ETIMEDOUT)
		return 0;
	if (err == -EBADMSG) {
		r->counts.damaged++;
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
	struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct picture_reader *r = &reading->readers[index];
	const char *rest;

	settings.blur_max_px = reading->config->calibration.blur_max_px;
	r->reading = reading;
	r->index = index;
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
		err = corner_finder_create(&r->finder, reading->board, &settings);
	r->counts.width_px = r->mode.width_px;
	r->counts.height_px = r->mode.height_px;
	reading->progress.of += err ? 0 : (uint32_t)files_camera_count(r->camera);
	return err;
}

static int compare_px(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static void close_reader(struct picture_reader *r)
{
	if (r->driver && r->camera) {
		r->driver->stop(r->camera);
		r->driver->close(r->camera);
	}
	corner_finder_destroy(r->finder);
	for (uint32_t i = 0; i < r->found_count; i++)
		free(r->found[i].px);
	free(r->found);
	free(r->blurs_px);
	free(r->grey);
	free(r->rgb);
}

static int compare_found(const void *a, const void *b)
{
	const struct found *x = a, *y = b;

	if (x->shot != y->shot)
		return x->shot < y->shot ? -1 : 1;
	if (x->mid_exposure_ns != y->mid_exposure_ns)
		return x->mid_exposure_ns < y->mid_exposure_ns ? -1 : 1;
	return (x->camera > y->camera) - (x->camera < y->camera);
}

/* Cameras that exposed together share a pose. One that exposed apart saw the board elsewhere. */
static int add_all(struct observations *o, const struct found *all, uint32_t count,
		   struct picture_counts *counts)
{
	uint32_t pose = 0;
	int err = 0;

	for (uint32_t i = 0, first = 0; i < count && !err; i++) {
		int64_t apart_ns = all[i].mid_exposure_ns - all[first].mid_exposure_ns;

		if (i > 0 && (all[i].shot != all[first].shot || apart_ns > TOGETHER_NS)) {
			if (all[i].shot == all[first].shot && all[i].shot != UINT64_MAX) {
				struct picture_counts *k = &counts[all[i].camera];
				k->apart++;
				k->apart_ms = fmax(k->apart_ms, 1e-6 * (double)apart_ns);
			}
			first = i;
			pose++;
		}
		err = observations_add(o, all[i].camera, pose, (const double(*)[2])all[i].px);
		if (err == -EEXIST)
			err = 0; /* a picture that is there twice */
	}
	return err;
}

static int put_together(struct observations *o, struct reading *reading,
			struct picture_counts *counts)
{
	uint32_t count = 0, camera_count = reading->config->camera_count;

	for (uint32_t c = 0; c < camera_count; c++)
		count += reading->readers[c].found_count;
	struct found *all = calloc(count + 1, sizeof(*all));
	if (!all)
		return -ENOMEM;
	count = 0;
	for (uint32_t c = 0; c < camera_count; c++) {
		struct picture_reader *r = &reading->readers[c];

		for (uint32_t i = 0; i < r->found_count; i++)
			all[count++] = r->found[i];
		qsort(r->blurs_px, r->blur_count, sizeof(double), compare_px);
		counts[c] = r->counts;
		counts[c].blur_px = r->blur_count ? r->blurs_px[r->blur_count / 2] : NAN;
	}
	qsort(all, count, sizeof(*all), compare_found);
	int err = add_all(o, all, count, counts);
	free(all);
	return err;
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
	struct observations made = {0};
	int err = 0;

	if (!reading)
		return -ENOMEM;
	reading->config = config;
	reading->board = board;
	reading->stop = stop;
	for (uint32_t c = 0; c < config->camera_count; c++) {
		int one = open_reader(reading, c, diag);

		err = err ? err : one;
	}
	if (!err)
		err = run(reading, progress, user, diag);
	if (!err)
		err = init_observations(&made, reading, diag);
	if (!err)
		err = put_together(&made, reading, counts);
	if (err)
		observations_finish(&made);
	else
		*observations = made;
	for (uint32_t c = 0; c < config->camera_count; c++)
		close_reader(&reading->readers[c]);
	free(reading);
	return err;
}
