/*
 * PNG by libpng, whose errors jump: everything that lives across the jump is in one struct.
 * The pixel values are taken as they are stored: no gamma, no colour profile.
 */
#include "drivers/image_png.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#define CHUNK_MAX_BYTES (8 << 20) /* of text and profiles, which nobody looks at */

struct png_job {
	const uint8_t *bytes;
	size_t left;
	jmp_buf failed;
	char *problem;
};

bool image_is_png(const uint8_t *bytes, size_t size)
{
	return size >= 8 && png_sig_cmp(bytes, 0, 8) == 0;
}

static void on_error(png_structp png, png_const_charp message)
{
	struct png_job *job = png_get_error_ptr(png);

	snprintf(job->problem, IMAGE_PROBLEM_BYTES, "damaged PNG: %s", message);
	longjmp(job->failed, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
	(void)png;
	(void)message;
}

static void on_read(png_structp png, png_bytep out, png_size_t count)
{
	struct png_job *job = png_get_io_ptr(png);

	if (count > job->left)
		png_error(png, "truncated");
	memcpy(out, job->bytes, count);
	job->bytes += count;
	job->left -= count;
}

/* What this station takes: 8 bits, grey or RGB, rows in order. NULL or what is wrong. */
static const char *check_kind(png_structp png, png_infop info)
{
	int colour = png_get_color_type(png, info);

	if (colour == PNG_COLOR_TYPE_PALETTE)
		return "a PNG with a palette; convert it to 8-bit grey or RGB";
	if (colour & PNG_COLOR_MASK_ALPHA || png_get_valid(png, info, PNG_INFO_tRNS))
		return "a PNG with transparency; convert it to 8-bit grey or RGB";
	if (png_get_bit_depth(png, info) != 8)
		return "a PNG that has not 8 bits a channel; convert it to 8-bit grey or RGB";
	if (png_get_interlace_type(png, info) != PNG_INTERLACE_NONE)
		return "an interlaced PNG; store it without interlacing";
	return NULL;
}

static int read_info(png_structp png, png_infop info, struct image *image, bool fixed_size,
		     char *problem)
{
	png_read_info(png, info);

	const char *wrong = check_kind(png, info);
	int width_px = (int)png_get_image_width(png, info);
	int height_px = (int)png_get_image_height(png, info);

	if (wrong) {
		snprintf(problem, IMAGE_PROBLEM_BYTES, "%s", wrong);
		return -EBADMSG;
	}
	if (fixed_size && (width_px != image->width_px || height_px != image->height_px)) {
		snprintf(problem, IMAGE_PROBLEM_BYTES, "is %dx%d, the first image is %dx%d",
			 width_px, height_px, image->width_px, image->height_px);
		return -EBADMSG;
	}
	image->width_px = width_px;
	image->height_px = height_px;
	image->channels = png_get_color_type(png, info) == PNG_COLOR_TYPE_RGB ? 3 : 1;
	return 0;
}

static int read_png(png_structp png, png_infop info, struct image *image, uint8_t *pixels,
		    char *problem)
{
	int err = read_info(png, info, image, pixels != NULL, problem);

	if (err || !pixels)
		return err;
	for (int y = 0; y < image->height_px; y++)
		png_read_row(png, pixels + (size_t)y * image->width_px * image->channels, NULL);
	png_read_end(png, NULL); /* checks the last checksum */
	image->pixels = pixels;
	return 0;
}

int image_read_png(const uint8_t *bytes, size_t size, struct image *image, uint8_t *pixels,
		   char problem[IMAGE_PROBLEM_BYTES])
{
	struct png_job job = {.bytes = bytes, .left = size, .problem = problem};
	png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
	png_infop info = png ? png_create_info_struct(png) : NULL;
	int err = -EBADMSG; /* what a jump leaves */

	if (!info) {
		snprintf(problem, IMAGE_PROBLEM_BYTES, "out of memory");
	} else if (setjmp(job.failed) == 0) {
		png_set_read_fn(png, &job, on_read);
		png_set_user_limits(png, IMAGE_SIZE_MAX_PX, IMAGE_SIZE_MAX_PX);
		png_set_chunk_malloc_max(png, CHUNK_MAX_BYTES);
		int result = read_png(png, info, image, pixels, problem);
		png_destroy_read_struct(&png, &info, NULL);
		return result;
	}
	png_destroy_read_struct(&png, &info, NULL);
	return err;
}
