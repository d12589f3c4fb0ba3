/*
 * Reads what kernel and system keep in files, below doctor->root. A file that is not there is a
 * normal answer: kernels differ.
 */
#pragma once

#include <glob.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/stat.h>

#include "ctl/doctor/doctor.h"

#define TREE_PATH_BYTES 512

/* The path below root. */
void tree_path(const struct doctor *doctor, char path[TREE_PATH_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* The first line, without its end. False, and an empty line, when the file cannot be read. */
bool tree_line(const struct doctor *doctor, char *line, size_t size, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* A file that holds one whole number; false, and *out untouched, otherwise. */
bool tree_number(const struct doctor *doctor, int64_t *out, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

bool tree_exists(const struct doctor *doctor, const char *path);

/* NULL when it cannot be opened; the caller closes it. */
FILE *tree_open(const struct doctor *doctor, const char *path);

/* What matches `pattern`, with root before it; for globfree(). Without a match: gl_pathc is 0. */
void tree_glob(const struct doctor *doctor, const char *pattern, glob_t *out);

/* Behind root, as a person knows it. */
const char *tree_name(const struct doctor *doctor, const char *path);
