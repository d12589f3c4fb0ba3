/*
 * An output file that appears whole or not at all: written beside its place, renamed when done.
 * Without a path it is standard output. One at a time per program.
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

/* Drops what was written; a no-op after commit. */
void output_file_discard(struct output_file *file);
