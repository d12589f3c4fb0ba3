/*
 * A file in /tmp that a program's tests write and read again, and the messages about it.
 */
#pragma once

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/diag.h"

static char path[] = "/tmp/one_fileXXXXXX";

/* Set-up and tear-down of the group of tests. */
static inline int make_file(void **state)
{
	int fd = mkstemp(path);

	(void)state;
	return fd < 0 ? -1 : close(fd);
}

static inline int remove_file(void **state)
{
	(void)state;
	return unlink(path);
}

static inline void write_file(const char *text, size_t size)
{
	FILE *file = fopen(path, "w");

	assert_non_null(file);
	assert_int_equal(fwrite(text, 1, size, file), size);
	fclose(file);
}

/* `messages` are the lines of `diag`, each without the path before it. Finishes `diag`. */
static inline void expect_lines(struct diag *diag, const char *messages)
{
	char found[4096] = "", *line, *rest;

	assert_non_null(diag->text);
	for (line = strtok_r(diag->text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
		assert_memory_equal(line, path, strlen(path));
		strcat(strcat(found, line + strlen(path) + 1), "\n");
	}
	assert_string_equal(found, messages);
	diag_finish(diag);
}
