/*
 * An output file that appears whole or not at all: written beside its place, renamed when done.
 * Without a path it is standard output. One at a time per program. Control threads only.
 */
#pragma once

#include <limits.h>
#include <stdio.h>

#include "base/diag.h"

struct output_file {
	FILE *stream;
	char path[PATH_MAX]; /* "" for standard output */
	char temporary[PATH_MAX];
};

/* Returns 0 or a negative errno with a message. */
int output_file_open(struct output_file *file, const char *path, struct diag *diag);

/* Flushes and moves the file to its place; on failure nothing is left behind. 0 or a negative errno
 * with a message. */
int output_file_commit(struct output_file *file, struct diag *diag);

/* Commits it, or drops it when writing it has failed with `err` (negative; 0: it has not), with the
 * same message. Returns `err`, or as output_file_commit(). */
int output_file_end(struct output_file *file, int err, struct diag *diag);

/* Drops what was written; a no-op after commit. */
void output_file_discard(struct output_file *file);
