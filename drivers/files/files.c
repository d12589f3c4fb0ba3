/*
 * The files: driver. Control calls are in files_open.c.
 */
#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/realtime.h"
#include "drivers/files/files_camera.h"

#define WAIT_MAX_NS (3600 * NS_PER_S) /* keeps sums of times within 64 bits */

/* Keeps the first cause for the control thread: written once, then published. */
static void note_damage(struct files_camera *camera, const char *path, const char *problem)
{
	if (atomic_fetch_add(&camera->damaged_count, 1) > 0)
		return;
	snprintf(camera->problem, sizeof(camera->problem), "%s: %s", path, problem);
	atomic_store_explicit(&camera->problem_known, true, memory_order_release);
}

static void stall(const struct files_camera *camera, const struct files_row *row)
{
	int64_t at_ns = row->mid_exposure_ns - camera->table.rows[0].mid_exposure_ns;

	for (int i = 0; i < camera->stall_count; i++) {
		const struct files_stall *s = &camera->stalls[i];

		if (at_ns >= s->from_ns && at_ns < s->until_ns &&
		    (row - camera->table.rows) % s->every == 0)
			clock_sleep_until(clock_now_ns() + s->delay_ns);
	}
}

/* Reads the image of the next row and steps past it. */
static int read_next(struct files_camera *camera)
{
	const struct files_row *row = &camera->table.rows[camera->next_row];
	char path[PATH_MAX + 1], problem[IMAGE_PROBLEM_BYTES];

	snprintf(path, sizeof(path), "%s/%s", camera->dir, row->file);
	camera->row = row;
	camera->next_row++;
	bool was_in_section = realtime_pause(); /* the disk: a documented exception */

	stall(camera, row);
	int err = image_read(&camera->reader, path, &camera->image, problem);

	realtime_resume(was_in_section);

	if (!err && camera->format == PIXEL_GREY8)
		image_make_grey(&camera->image);
	bool is_rgb = camera->image.channels == 3;

	if (!err && is_rgb != (camera->format == PIXEL_RGB8)) {
		snprintf(problem, sizeof(problem), "is %s, the first image is %s",
			 is_rgb ? "RGB" : "grey", is_rgb ? "grey" : "RGB");
		err = -EBADMSG;
	}
	if (err)
		note_damage(camera, path, problem);
	camera->has_image = !err;
	return err ? -EBADMSG : 0;
}

/* The end of the recording, behind a line that was cut off if there is one. */
static int tell_cut_line(struct files_camera *camera)
{
	char path[PATH_MAX + 32];

	if (!camera->table.cut_line || camera->cut_told)
		return -ENODATA;
	camera->cut_told = true;
	snprintf(path, sizeof(path), "%s/frames.csv:%d", camera->dir, camera->table.cut_line);
	note_damage(camera, path, "cut off in mid-line, and left out");
	return -EBADMSG;
}

/* Waits until the image is due: 0 or -ETIMEDOUT. */
static int wait_until_due(const struct files_camera *camera, int64_t deadline_ns)
{
	int64_t due_ns = camera->row->mid_exposure_ns + camera->shift_ns;

	if (due_ns > deadline_ns) {
		clock_sleep_until(deadline_ns);
		return -ETIMEDOUT;
	}
	clock_sleep_until(due_ns);
	return 0;
}

static void fill_frame(const struct files_camera *camera, struct frame *out)
{
	const struct files_row *row = camera->row;
	const struct image *image = &camera->image;

	*out = (struct frame){
		.pixels = image->pixels,
		.width_px = image->width_px,
		.height_px = image->height_px,
		.stride_bytes = image->width_px * image->channels,
		.format = camera->format,
		.shot = row->shot,
		.device_seq = (uint64_t)(row - camera->table.rows),
		.mid_exposure_ns = row->mid_exposure_ns + camera->shift_ns,
		.uncertainty_ns = row->uncertainty_ns,
		/* unpaced: there is no other time than the recording's */
		.arrival_ns = camera->paced ? clock_now_ns() : row->mid_exposure_ns,
	};
}

int files_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct files_camera *camera = (struct files_camera *)base;
	int64_t wait_ns = timeout_ns < WAIT_MAX_NS ? timeout_ns : WAIT_MAX_NS;
	int64_t deadline_ns = clock_now_ns() + wait_ns;
	int err;

	assert(!camera->lent);
	if (!camera->has_image) {
		if (camera->next_row == camera->table.row_count)
			return tell_cut_line(camera);
		err = read_next(camera); /* ahead of its time */
		if (err)
			return err;
	}
	if (camera->paced) {
		err = wait_until_due(camera, deadline_ns);
		if (err)
			return err;
	}
	fill_frame(camera, out);
	camera->has_image = false;
	camera->lent = true;
	return 0;
}

void files_release(struct camera *base, struct frame *frame)
{
	struct files_camera *camera = (struct files_camera *)base;

	(void)frame;
	camera->lent = false;
}

uint64_t files_camera_count(const struct camera *base)
{
	return ((const struct files_camera *)base)->table.row_count;
}

int files_camera_line(const struct camera *base, uint64_t device_seq)
{
	return ((const struct files_camera *)base)->table.rows[device_seq].line;
}

uint64_t files_camera_damaged_count(const struct camera *base)
{
	return atomic_load(&((const struct files_camera *)base)->damaged_count);
}

int files_camera_stall(struct camera *base, const struct files_stall *stall)
{
	struct files_camera *camera = (struct files_camera *)base;

	if (camera->stall_count == FILES_STALL_MAX)
		return -ENOSPC;
	camera->stalls[camera->stall_count++] = *stall;
	return 0;
}

const char *files_camera_problem(const struct camera *base)
{
	const struct files_camera *camera = (const struct files_camera *)base;

	return atomic_load_explicit(&camera->problem_known, memory_order_acquire) ? camera->problem
										  : "";
}
