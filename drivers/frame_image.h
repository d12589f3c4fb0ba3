/*
 * A frame's pixels as the blob finder takes them.
 */
#pragma once

#include <stdbool.h>

#include "drivers/camera.h"
#include "track/blobs/blobs.h"

static inline bool pixels_are_grey(enum pixel_format format)
{
	return format == PIXEL_GREY8 || format == PIXEL_GREY16;
}

/* The image of a grey frame, in place. Words of which the device does not say how many bits they
 * use are taken to use them all. */
static inline struct grey_image frame_grey_image(const struct frame *frame)
{
	bool is_known = frame->bits > 8 && frame->bits <= 16;
	int bits = frame->format != PIXEL_GREY16 ? 8 : is_known ? frame->bits : 16;

	return (struct grey_image){frame->pixels, frame->width_px, frame->height_px,
				   frame->stride_bytes, bits};
}
