/*
 * Of a mosaic the 3x3 pixels around each, weighted 1 2 1 both ways: that is a quarter of red, half
 * of green and a quarter of blue wherever the pixel stands in it, and symmetrical.
 */
#include "ctl/picture_grey.h"

#include <errno.h>
#include <stdlib.h>

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

static void from_mosaic(const struct raw_picture *p, uint8_t *out)
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

static void words_row(const uint8_t *words, int bits, int width, uint8_t *out)
{
	for (int x = 0; x < width; x++, words += 2) {
		unsigned grey = (words[0] | (unsigned)words[1] << 8) >> (bits > 8 ? bits - 8 : 0);

		out[x] = (uint8_t)(grey > 255 ? 255 : grey);
	}
}

static void luma_row(const uint8_t *yuyv, int width, uint8_t *out)
{
	for (int x = 0; x < width; x++)
		out[x] = yuyv[2 * x];
}

static void from_rows(const struct raw_picture *p, uint8_t *out)
{
	for (int y = 0; y < p->height_px; y++, out += p->width_px) {
		const uint8_t *row = p->pixels + (ptrdiff_t)y * p->stride_bytes;

		if (p->format == PIXEL_RGB8)
			rgb_row(row, p->width_px, out);
		else if (p->format == PIXEL_GREY16)
			words_row(row, p->bits, p->width_px, out);
		else
			luma_row(row, p->width_px, out);
	}
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

int picture_grey(struct grey_room *room, const struct raw_picture *picture,
		 struct grey_image *image)
{
	*image = (struct grey_image){picture->pixels, picture->width_px, picture->height_px,
				     picture->stride_bytes};
	if (picture->format == PIXEL_GREY8)
		return 0;
	if (picture->format == PIXEL_MJPEG)
		return -ENOTSUP;
	int err = make_room(room, (size_t)picture->width_px * (size_t)picture->height_px);
	if (err)
		return err;
	switch (picture->format) {
	case PIXEL_BAYER_RG8:
	case PIXEL_BAYER_GR8:
	case PIXEL_BAYER_GB8:
	case PIXEL_BAYER_BG8:
		from_mosaic(picture, room->pixels);
		break;
	default:
		from_rows(picture, room->pixels);
	}
	*image = (struct grey_image){room->pixels, picture->width_px, picture->height_px,
				     picture->width_px};
	return 0;
}

void grey_room_finish(struct grey_room *room)
{
	free(room->pixels);
	*room = (struct grey_room){0};
}
