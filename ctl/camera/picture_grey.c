/*
 * Of a mosaic the 3x3 pixels around each, weighted 1 2 1 both ways: that is a quarter of red, half
 * of green and a quarter of blue wherever the pixel stands in it, and symmetrical.
 */
#include "ctl/camera/picture_grey.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "ctl/camera/picture_plain.h"

static int clamped(int at, int count)
{
	/* mirrored, so that the colours alternate beyond the border too */
	return at < 0 ? 1 : at >= count ? count - 2 : at;
}

static void mosaic_row(const uint8_t *above, const uint8_t *here, const uint8_t *below, int width,
		       uint8_t *out)
{
	for (int x = 0; x < width; x++) {
		int left = clamped(x - 1, width), right = clamped(x + 1, width);
		unsigned sum = above[left] + 2u * above[x] + above[right] +
			       2u * (here[left] + 2u * here[x] + here[right]) + below[left] +
			       2u * below[x] + below[right];

		out[x] = (uint8_t)((sum + 8) / 16);
	}
}

static void from_mosaic(const struct frame *p, uint8_t *out)
{
	for (int y = 0; y < p->height_px; y++) {
		const uint8_t *rows[3];

		for (int k = 0; k < 3; k++)
			rows[k] = p->pixels +
				  (ptrdiff_t)clamped(y - 1 + k, p->height_px) * p->stride_bytes;
		mosaic_row(rows[0], rows[1], rows[2], p->width_px,
			   out + (size_t)y * (size_t)p->width_px);
	}
}

/* BT.601 luma, as for files that are made grey. */
static void rgb_row(const uint8_t *rgb, int width, uint8_t *out)
{
	for (int x = 0; x < width; x++, rgb += 3)
		out[x] = (uint8_t)((299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2] + 500) / 1000);
}

static void from_rgb(const uint8_t *rgb, int stride_bytes, int width, int height, uint8_t *out)
{
	for (int y = 0; y < height; y++)
		rgb_row(rgb + (ptrdiff_t)y * stride_bytes, width, out + (size_t)y * (size_t)width);
}

static int make_room(struct grey_room *room, size_t size_bytes)
{
	if (room->size_bytes >= size_bytes)
		return 0;
	grey_room_finish(room);
	room->pixels = malloc(size_bytes);
	if (!room->pixels)
		return -ENOMEM;
	room->size_bytes = size_bytes;
	return 0;
}

/* Formats of USB cameras, by way of what a person would look at. */
static int from_plain(const struct frame *frame, uint8_t *out)
{
	enum pixel_format plain;
	uint8_t *pixels;
	int err = picture_make_plain(frame, &pixels, &plain);

	if (err)
		return err;
	if (plain == PIXEL_GREY8)
		memcpy(out, pixels, (size_t)frame->width_px * (size_t)frame->height_px);
	else
		from_rgb(pixels, 3 * frame->width_px, frame->width_px, frame->height_px, out);
	free(pixels);
	return 0;
}

static int fill(const struct frame *frame, uint8_t *out)
{
	switch (frame->format) {
	case PIXEL_BAYER_RG8:
	case PIXEL_BAYER_GR8:
	case PIXEL_BAYER_GB8:
	case PIXEL_BAYER_BG8:
		from_mosaic(frame, out);
		return 0;
	case PIXEL_RGB8:
		from_rgb(frame->pixels, frame->stride_bytes, frame->width_px, frame->height_px,
			 out);
		return 0;
	default:
		return from_plain(frame, out);
	}
}

int picture_grey(struct grey_room *room, const struct frame *frame, struct grey_image *image)
{
	struct grey_image made = {frame->pixels, frame->width_px, frame->height_px,
				  frame->stride_bytes, 8};

	if (frame->format != PIXEL_GREY8) {
		int err = make_room(room, (size_t)frame->width_px * (size_t)frame->height_px);

		if (!err)
			err = fill(frame, room->pixels);
		if (err)
			return err;
		made.pixels = room->pixels;
		made.stride_bytes = frame->width_px;
	}
	*image = made;
	return 0;
}

void grey_room_finish(struct grey_room *room)
{
	free(room->pixels);
	*room = (struct grey_room){0};
}
