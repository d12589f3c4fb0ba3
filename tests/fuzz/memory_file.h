/*
 * Bytes as a file that has a path, without a disk.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

/* The path of one file of this process, which from now on holds these bytes. Aborts on failure. */
const char *memory_file(const uint8_t *data, size_t size);
