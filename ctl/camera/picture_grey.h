/*
 * Any picture of a camera as grey rows in which edges stand where they stood: for measuring, not
 * for looking at.
 */
#pragma once

#include "drivers/camera.h"
#include "track/blobs/blobs.h"

/* Where pictures that are not grey are made so. */
struct grey_room {
	uint8_t *pixels; /* owned */
	size_t size_bytes;
};

/* Points `image` to the frame itself or into the room. Returns 0, -ENOMEM, or -EBADMSG for a JPEG
 * that is damaged. */
int picture_grey(struct grey_room *room, const struct frame *frame, struct grey_image *image);
void grey_room_finish(struct grey_room *room); /* a zeroed one is fine */
