/*
 * The files of a recording: a directory that is ours to fill, and files that get their names when
 * they are whole. Every failure is a message that names the path.
 */
#pragma once

#include <limits.h>
#include <stdio.h>

#include "base/diag.h"

/* A file that gets its name when it is whole. A zeroed one is closed. */
struct part_file {
	FILE *file;
	char path[PATH_MAX], part_path[PATH_MAX];
};

/* Adds "PATH: cannot WHAT: CAUSE" and returns -err. */
int record_fail(struct diag *diag, const char *path, const char *what, int err);

/* Returns 0, or -ENAMETOOLONG with a message. */
__attribute__((format(printf, 3, 4))) int record_path(struct diag *diag, char path[PATH_MAX],
						      const char *format, ...);

/* An older file of that name is gone from then on. */
int part_file_open(struct part_file *part, const char *path, struct diag *diag);
int part_file_finish(struct part_file *part, struct diag *diag);

/* Makes the directory, or finds it empty or holding an older recording (it has `mark` or its
 * part); anything else is -EEXIST: nothing of the user's is overwritten. */
int record_claim_dir(const char *dir, const char *mark, struct diag *diag);

/* Makes the directory of a camera and removes older images from it. */
int record_clear_images(const char *dir, struct diag *diag);
