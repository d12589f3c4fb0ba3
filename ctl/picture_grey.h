/*
 * Any picture of a camera as grey rows in which edges stand where they stood: for measuring, not
 * for looking at.
 */
#pragma once

#include "drivers/pixel_format.h"
#include "track/blobs.h"

struct raw_picture {
	const uint8_t *pixels;
	int width_px, height_px, stride_bytes;
	enum pixel_format format;
	int bits; /* of PIXEL_GREY16 */
};

/* Where pictures that are not grey are made so. */
struct grey_room {
	uint8_t *pixels; /* owned */
	size_t size_bytes;
};

/* Points `image` to the picture itself or into the room. Returns 0, -ENOMEM, or -ENOTSUP: this
 * program cannot decode the format. */
int picture_grey(struct grey_room *room, const struct raw_picture *picture,
		 struct grey_image *image);
void grey_room_finish(struct grey_room *room); /* a zeroed one is fine */
