/*
 * Shared by the files of the files: driver only.
 */
#pragma once

#include <limits.h>
#include <stdatomic.h>

#include "drivers/files/files.h"
#include "drivers/files/files_table.h"
#include "drivers/image_file.h"

struct files_camera {
	struct camera base;
	/* set before the capture thread starts */
	bool paced;
	char dir[PATH_MAX];
	struct files_table table;
	struct image first; /* its size and channels; no pixels */
	enum pixel_format format;
	int64_t shift_ns; /* recorded time to CLOCK_MONOTONIC; 0 unpaced */
	bool started;
	struct files_stall stalls[FILES_STALL_MAX];
	int stall_count;
	/* owned by the capture thread */
	struct image_reader reader;
	struct image image;
	const struct files_row *row; /* of `image` */
	size_t next_row;
	bool has_image; /* read, not yet lent */
	bool lent;
	bool cut_told;
	/* any thread */
	_Atomic uint64_t damaged_count;
	_Atomic bool problem_known;
	char problem[PATH_MAX + IMAGE_PROBLEM_BYTES + 32]; /* set once before problem_known */
};

int files_acquire(struct camera *base, int64_t timeout_ns, struct frame *out);
void files_release(struct camera *base, struct frame *frame);
