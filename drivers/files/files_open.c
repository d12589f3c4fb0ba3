/*
 * The control calls of the files: driver: everything that a recording can lack shows here, before
 * the capture thread starts.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "drivers/files/files_camera.h"

/* Between the first start and the first frame: time to start the other cameras. */
#define LEAD_NS (300 * NS_PER_MS)

/* The one shift of all paced cameras that run together. Control thread. */
static struct {
	int running_count;
	int64_t shift_ns;
} pace;

/* A directory of files is not found by looking: there is nothing to list. */
static int files_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)found;
	(void)user;
	(void)diag;
	return 0;
}

static int find_dir(struct files_camera *camera, const char *rest, const char *base_dir,
		    struct diag *diag)
{
	bool joined = base_dir && *rest != '/';
	int length = snprintf(camera->dir, sizeof(camera->dir), "%s%s%s", joined ? base_dir : "",
			      joined ? "/" : "", rest);
	struct stat st;

	if (length >= (int)sizeof(camera->dir)) {
		diag_add(diag, "camera files:%.40s...: the path is too long", rest);
		return -ENAMETOOLONG;
	}
	if (stat(camera->dir, &st) < 0) {
		int err = -errno;

		diag_add(diag, "camera files:%s: %s: %s; the address must name a directory", rest,
			 camera->dir, strerror(-err));
		return err;
	}
	if (S_ISDIR(st.st_mode))
		return 0;
	diag_add(diag, "camera files:%s: %s is not a directory", rest, camera->dir);
	return -ENOTDIR;
}

static int find_file(const struct files_camera *camera, const struct files_row *row,
		     char path[PATH_MAX + 1])
{
	int length = snprintf(path, PATH_MAX + 1, "%s/%s", camera->dir, row->file);
	struct stat st;

	if (length >= PATH_MAX)
		return -ENAMETOOLONG;
	if (stat(path, &st) < 0)
		return -errno;
	return S_ISREG(st.st_mode) ? 0 : -EINVAL;
}

static void tell_missing(const struct files_camera *camera, struct diag *diag)
{
	char path[PATH_MAX + 1];

	for (size_t i = 0; i < camera->table.row_count; i++) {
		const struct files_row *row = &camera->table.rows[i];

		if (find_file(camera, row, path))
			diag_add(diag,
				 "%s/frames.csv:%d: file: '%.40s' is not a file in this directory",
				 camera->dir, row->line, row->file);
	}
}

/* Images that are not there are lost pictures, counted when their turn comes; where most are, it is
 * another directory's table. What is there and no file may not be read. `first` is one that is. */
static int check_files(const struct files_camera *camera, const struct files_row **first,
		       struct diag *diag)
{
	const struct files_table *table = &camera->table;
	const struct files_row *found = NULL;
	char path[PATH_MAX + 1];
	size_t missing = 0;
	bool wrong = false;

	for (size_t i = 0; i < table->row_count; i++) {
		int err = find_file(camera, &table->rows[i], path);

		if (!err && !found)
			found = &table->rows[i];
		missing += err == -ENOENT;
		wrong |= err && err != -ENOENT;
	}
	if (wrong || 2 * missing > table->row_count) {
		tell_missing(camera, diag);
		return -EINVAL;
	}
	*first = found;
	return 0;
}

static int read_first(struct files_camera *camera, const struct files_row *first, struct diag *diag)
{
	char path[PATH_MAX + 1], problem[IMAGE_PROBLEM_BYTES];

	snprintf(path, sizeof(path), "%s/%s", camera->dir, first->file);
	int err = image_probe(path, &camera->first, problem);
	if (err) {
		diag_add(diag, "%s: %s", path, problem);
		return err;
	}
	err = image_reader_init(&camera->reader, camera->first.width_px, camera->first.height_px);
	if (err)
		diag_add(diag, "%s: %s", path, strerror(-err));
	return err;
}

static int load_recording(struct files_camera *camera, struct diag *diag)
{
	const struct files_row *first;
	char path[PATH_MAX + 16];

	snprintf(path, sizeof(path), "%s/frames.csv", camera->dir);
	int err = files_table_load(&camera->table, path, diag);
	if (!err)
		err = check_files(camera, &first, diag);
	return err ? err : read_first(camera, first, diag);
}

static void files_close(struct camera *base)
{
	struct files_camera *camera = (struct files_camera *)base;

	if (!camera)
		return;
	files_table_finish(&camera->table);
	image_reader_finish(&camera->reader);
	free(camera);
}

static int open_with(const struct camera_driver *driver, struct camera **out, const char *rest,
		     const char *base_dir, struct diag *diag)
{
	struct files_camera *camera = calloc(1, sizeof(*camera));
	int err;

	if (!camera) {
		diag_add(diag, "camera files:%s: %s", rest, strerror(ENOMEM));
		return -ENOMEM;
	}
	camera->base.driver = driver;
	camera->paced = driver == &files_camera_driver;
	err = find_dir(camera, rest, base_dir, diag);
	if (!err)
		err = load_recording(camera, diag);
	if (err) {
		files_close(&camera->base);
		return err;
	}
	*out = &camera->base;
	return 0;
}

static int open_paced(struct camera **out, const char *rest, const char *base_dir,
		      struct diag *diag)
{
	return open_with(&files_camera_driver, out, rest, base_dir, diag);
}

static int open_unpaced(struct camera **out, const char *rest, const char *base_dir,
			struct diag *diag)
{
	return open_with(&files_camera_driver_unpaced, out, rest, base_dir, diag);
}

/* RGB can be had as it is or as grey. Grey files are a Bayer mosaic when one is asked for: nothing
 * in them says which they are. */
static enum pixel_format granted_format(enum pixel_format wanted, int channels)
{
	if (wanted == PIXEL_GREY8)
		return PIXEL_GREY8;
	if (channels == 3)
		return PIXEL_RGB8;
	return wanted == PIXEL_BAYER_RG8 ? PIXEL_BAYER_RG8 : PIXEL_GREY8;
}

/* Size and time are the recording's. */
static int files_configure(struct camera *base, const struct camera_mode *wanted,
			   struct camera_mode *granted, struct diag *diag)
{
	struct files_camera *camera = (struct files_camera *)base;

	(void)diag;
	camera->format = granted_format(wanted->format, camera->first.channels);
	*granted = (struct camera_mode){
		.width_px = camera->first.width_px,
		.height_px = camera->first.height_px,
		.format = camera->format,
		.period_ns = files_table_period_ns(&camera->table),
	};
	return 0;
}

/* From the first image on, each time. */
static int files_start(struct camera *base, struct diag *diag)
{
	struct files_camera *camera = (struct files_camera *)base;

	(void)diag;
	if (camera->started)
		return 0;
	camera->started = true;
	camera->next_row = 0;
	camera->has_image = false;
	camera->lent = false;
	camera->problem_known = false;
	camera->cut_told = false;
	camera->damaged_count = 0;
	if (!camera->paced)
		return 0;
	if (pace.running_count++ == 0)
		pace.shift_ns = clock_now_ns() + LEAD_NS - camera->table.rows[0].mid_exposure_ns;
	camera->shift_ns = pace.shift_ns;
	return 0;
}

static void files_stop(struct camera *base)
{
	struct files_camera *camera = (struct files_camera *)base;

	if (!camera->started)
		return;
	camera->started = false;
	if (camera->paced)
		pace.running_count--;
}

static void stop_and_close(struct camera *base)
{
	if (base)
		files_stop(base);
	files_close(base);
}

const struct camera_driver files_camera_driver = {
	.name = "files",
	.list = files_list,
	.open = open_paced,
	.close = stop_and_close,
	.configure = files_configure,
	.start = files_start,
	.stop = files_stop,
	.acquire = files_acquire,
	.release = files_release,
};

const struct camera_driver files_camera_driver_unpaced = {
	.name = "files",
	.list = files_list,
	.open = open_unpaced,
	.close = stop_and_close,
	.configure = files_configure,
	.start = files_start,
	.stop = files_stop,
	.acquire = files_acquire,
	.release = files_release,
};
