/*
 * The other formats made plain. A camera's JPEG is untrusted: libjpeg's errors end the decoding.
 */
#include "ctl/camera/picture_plain.h"

#include <errno.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h> /* needs stdio.h */

#include "ctl/camera/demosaic.h"

struct jpeg_failure {
	struct jpeg_error_mgr manager; /* first, so that libjpeg's pointer is ours */
	jmp_buf back;
};

static void jump_back(j_common_ptr decoder)
{
	longjmp(((struct jpeg_failure *)decoder->err)->back, 1);
}

static void say_nothing(j_common_ptr decoder)
{
	(void)decoder;
}

static int decode_jpeg(const struct frame *frame, uint8_t *rgb)
{
	struct jpeg_failure failure;
	struct jpeg_decompress_struct decoder = {.err = jpeg_std_error(&failure.manager)};

	failure.manager.error_exit = jump_back;
	failure.manager.output_message = say_nothing;
	if (setjmp(failure.back)) {
		jpeg_destroy_decompress(&decoder);
		return -EBADMSG;
	}
	jpeg_create_decompress(&decoder);
	jpeg_mem_src(&decoder, frame->pixels, frame->size_bytes);
	jpeg_read_header(&decoder, TRUE);
	if (decoder.image_width != (JDIMENSION)frame->width_px ||
	    decoder.image_height != (JDIMENSION)frame->height_px)
		jump_back((j_common_ptr)&decoder);
	decoder.out_color_space = JCS_RGB;
	jpeg_start_decompress(&decoder);
	while (decoder.output_scanline < decoder.output_height) {
		JSAMPROW row = rgb + (size_t)decoder.output_scanline * 3 * (size_t)frame->width_px;

		jpeg_read_scanlines(&decoder, &row, 1);
	}
	jpeg_finish_decompress(&decoder);
	jpeg_destroy_decompress(&decoder);
	return 0;
}

static uint8_t clamped(int value)
{
	return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
}

/* ITU-R BT.601 in the range 16 to 235, as USB cameras give it; in 1/1024. */
static void yuv_to_rgb(int y, int u, int v, uint8_t rgb[3])
{
	int light = 1192 * (y - 16) + 512;

	rgb[0] = clamped((light + 1634 * (v - 128)) / 1024);
	rgb[1] = clamped((light - 401 * (u - 128) - 833 * (v - 128)) / 1024);
	rgb[2] = clamped((light + 2066 * (u - 128)) / 1024);
}

static void row_from_yuyv(const uint8_t *row, int width_px, uint8_t *rgb)
{
	for (int x = 0; x < width_px; x++) {
		const uint8_t *pair = row + 4 * (x / 2);
		int v = x / 2 * 2 + 1 < width_px ? pair[3] : 128; /* an odd width ends in Y U */

		yuv_to_rgb(row[2 * x], pair[1], v, rgb + 3 * x);
	}
}

static void row_from_grey16(const uint8_t *row, int width_px, int bits, uint8_t *grey)
{
	int shift = bits > 16 ? 8 : bits > 8 ? bits - 8 : 0;

	for (int x = 0; x < width_px; x++) {
		int word = (row[2 * x] | row[2 * x + 1] << 8) >> shift;

		grey[x] = (uint8_t)(word > 255 ? 255 : word);
	}
}

static void copy_rows(const struct frame *frame, uint8_t *to)
{
	size_t row_bytes = pixel_row_bytes(frame->format, frame->width_px);

	for (int y = 0; y < frame->height_px; y++)
		memcpy(to + (size_t)y * row_bytes,
		       frame->pixels + (ptrdiff_t)y * frame->stride_bytes, row_bytes);
}

/* Of mosaics the rows are brought together first. */
static int from_mosaic(const struct frame *frame, uint8_t *rgb)
{
	size_t count = (size_t)frame->width_px * (size_t)frame->height_px;
	uint8_t *mosaic = malloc(count);

	if (!mosaic)
		return -ENOMEM;
	copy_rows(frame, mosaic);
	demosaic(mosaic, frame->width_px, frame->height_px, frame->format, rgb);
	free(mosaic);
	return 0;
}

static int convert(const struct frame *frame, uint8_t *out)
{
	for (int y = 0; y < frame->height_px; y++) {
		const uint8_t *row = frame->pixels + (ptrdiff_t)y * frame->stride_bytes;
		size_t first = (size_t)y * (size_t)frame->width_px;

		if (frame->format == PIXEL_GREY16)
			row_from_grey16(row, frame->width_px, frame->bits, out + first);
		else
			row_from_yuyv(row, frame->width_px, out + 3 * first);
	}
	return 0;
}

static enum pixel_format plain_format(enum pixel_format format)
{
	switch (format) {
	case PIXEL_GREY8:
	case PIXEL_GREY16:
		return PIXEL_GREY8;
	case PIXEL_BAYER_RG8:
		return PIXEL_BAYER_RG8;
	default:
		return PIXEL_RGB8;
	}
}

static int fill(const struct frame *frame, uint8_t *out)
{
	switch (frame->format) {
	case PIXEL_GREY16:
	case PIXEL_YUYV:
		return convert(frame, out);
	case PIXEL_MJPEG:
		return decode_jpeg(frame, out);
	case PIXEL_BAYER_GR8:
	case PIXEL_BAYER_GB8:
	case PIXEL_BAYER_BG8:
		return from_mosaic(frame, out);
	default:
		copy_rows(frame, out);
		return 0;
	}
}

int picture_make_plain(const struct frame *frame, uint8_t **pixels, enum pixel_format *format)
{
	enum pixel_format plain = plain_format(frame->format);
	uint8_t *made = calloc((size_t)frame->height_px, pixel_row_bytes(plain, frame->width_px));

	if (!made)
		return -ENOMEM;
	int error = fill(frame, made);

	if (error) {
		free(made);
		return error;
	}
	*pixels = made;
	*format = plain;
	return 0;
}
