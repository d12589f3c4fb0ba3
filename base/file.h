/*
 * A small file from outside, read whole. Control threads only: it allocates.
 */
#pragma once

#include <stddef.h>

#include "base/diag.h"

/* Reads at most `size_max` bytes into a new buffer with a NUL behind them; the caller frees it.
 * Returns 0, -EFBIG, -EISDIR, or another errno of open and read, with a message that names the
 * path. */
int file_read(char **text, size_t *size, const char *path, size_t size_max, struct diag *diag);
