/*
 * `files:DIR`: a directory of images and frames.csv as a camera (files_table.h, image_file.h).
 *
 * Two clocks, two driver tables of the same name; the program's list of drivers picks one:
 * - paced: a frame comes when it is due. Recorded times are shifted to CLOCK_MONOTONIC by one
 *   amount for all cameras that run together, so that what was simultaneous stays so.
 * - unpaced: a frame comes as soon as it is asked for, with its time as recorded; nothing is
 * dropped.
 *
 * acquire reads the disk and may block there: the documented exception among the drivers. It
 * allocates nothing, except that libpng does for a PNG.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver files_camera_driver; /* paced */
extern const struct camera_driver files_camera_driver_unpaced;

/* Any thread, while it is open: how many images the recording has. */
uint64_t files_camera_count(const struct camera *camera);

/* Any thread, while it is open: the line of frames.csv that a frame is of. */
int files_camera_line(const struct camera *camera, uint64_t device_seq);

/* Any thread, while it is open: how many images could not be read since start, and the first cause
 * ("DIR/000007.pgm: truncated: ..."), "" when there is none. */
uint64_t files_camera_damaged_count(const struct camera *camera);
const char *files_camera_problem(const struct camera *camera);

/* A slow disk, for trials: of the images exposed from `from_ns` to `until_ns` after the recording's
 * first, every Nth takes `delay_ns` longer to read. */
struct files_stall {
	int64_t from_ns, until_ns, delay_ns;
	int every;
};

#define FILES_STALL_MAX 8

/* Control thread, between open and start. Returns 0, or -ENOSPC when there are as many already. */
int files_camera_stall(struct camera *camera, const struct files_stall *stall);
