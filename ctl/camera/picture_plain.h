/*
 * A camera's picture as a person's program wants it: grey or RGB, 8 bits, rows without padding.
 * Bayer of the usual order is left as it is. Not for the live path: it decodes.
 */
#pragma once

#include <stdint.h>

#include "drivers/camera.h"

/* `*pixels` is the caller's to free and `*format` says what it holds. Returns 0, -ENOMEM, or
 * -EBADMSG for a JPEG that is damaged or of another size. */
int picture_make_plain(const struct frame *frame, uint8_t **pixels, enum pixel_format *format);
