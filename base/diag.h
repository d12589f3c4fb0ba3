/*
 * What is wrong with something from outside, in words: a list of one-line messages that a
 * loader fills and a program prints. One run reports every error, not only the first.
 */
#pragma once

#include <stdbool.h>
#include <stdio.h>

struct diag {
	char *text;        /* NUL-terminated lines, owned; NULL while empty */
	size_t size_bytes; /* of text, without the NUL */
	int count;         /* messages added, including those past the limit and not kept */
};

#define DIAG_MAX 50 /* messages kept; the rest are counted */

/* Frees the text and zeroes the struct. A zeroed struct is a valid empty diag. */
void diag_finish(struct diag *diag);

/* Adds one message (no newline needed). `diag` may be NULL: then the message is dropped. */
void diag_add(struct diag *diag, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Prints every message, one a line, and how many more were not kept. */
void diag_print(const struct diag *diag, FILE *out);
