/*
 * The PNG half of image_file.c.
 */
#pragma once

#include <stdbool.h>

#include "drivers/image_file.h"

bool image_is_png(const uint8_t *bytes, size_t size);

/* Reads size and channels; when `pixels` is not NULL, also the rows, of an image that must have the
 * size given in `image`. Returns 0 or -EBADMSG. */
int image_read_png(const uint8_t *bytes, size_t size, struct image *image, uint8_t *pixels,
		   char problem[IMAGE_PROBLEM_BYTES]);
