/*
 * PNM images, and reading files whole into memory that is there already.
 */
#include "drivers/image_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/image_png.h"

#define PROBE_BYTES 4096 /* a header is in them, with reasonable comments */
#define HEADER_MAX_BYTES (64 << 10)
#define P2_PIXEL_BYTES 4 /* "255 ", the largest form that an image may have */

/* Text of a PNM: blanks and comments between numbers. */
struct pnm_text {
	const uint8_t *at, *end;
};

static int complain(char *problem, const char *what)
{
	snprintf(problem, IMAGE_PROBLEM_BYTES, "%s", what);
	return -EBADMSG;
}

static void skip_blanks(struct pnm_text *text)
{
	while (text->at < text->end) {
		if (*text->at == '#')
			while (text->at < text->end && *text->at != '\n')
				text->at++;
		else if (!memchr(" \t\r\n", *text->at, 4))
			return;
		else
			text->at++;
	}
}

/* A number up to `max`, or -1. */
static int read_number(struct pnm_text *text, int max)
{
	int number = 0;

	skip_blanks(text);
	if (text->at == text->end || *text->at < '0' || *text->at > '9')
		return -1;
	while (text->at < text->end && *text->at >= '0' && *text->at <= '9') {
		number = number * 10 + (*text->at++ - '0');
		if (number > max)
			return -1;
	}
	return number;
}

/* Reads magic, size and maximum; leaves `text` at the first pixel. */
static int read_pnm_header(struct pnm_text *text, struct image *image, bool *ascii, char *problem)
{
	if (text->end - text->at < 3 || text->at[0] != 'P' || !memchr("256", text->at[1], 3))
		return complain(problem, "neither PNG nor PNM of kind P2, P5 or P6");
	*ascii = text->at[1] == '2';
	image->channels = text->at[1] == '6' ? 3 : 1;
	text->at += 2;
	image->width_px = read_number(text, IMAGE_SIZE_MAX_PX);
	image->height_px = read_number(text, IMAGE_SIZE_MAX_PX);
	if (image->width_px <= 0 || image->height_px <= 0)
		return complain(problem, "the PNM header has no size of 1 to 16384 pixels");
	if (read_number(text, 1 << 20) != 255)
		return complain(problem, "the PNM's maximum is not 255; convert it to 8 bits");
	if (text->at++ == text->end)
		return complain(problem, "truncated behind the PNM header");
	return 0;
}

static int read_ascii(struct pnm_text *text, uint8_t *pixels, size_t count, char *problem)
{
	for (size_t i = 0; i < count; i++) {
		int grey = read_number(text, 255);

		if (grey < 0)
			return complain(problem, "truncated, or a pixel is not from 0 to 255");
		pixels[i] = (uint8_t)grey;
	}
	return 0;
}

static int check_size(const struct image_reader *reader, const struct image *image, char *problem)
{
	if (image->width_px == reader->width_px && image->height_px == reader->height_px)
		return 0;
	snprintf(problem, IMAGE_PROBLEM_BYTES, "is %dx%d, the first image is %dx%d",
		 image->width_px, image->height_px, reader->width_px, reader->height_px);
	return -EBADMSG;
}

static int decode_pnm(struct image_reader *reader, uint8_t *bytes, size_t size, struct image *image,
		      char *problem)
{
	struct pnm_text text = {bytes, bytes + size};
	bool ascii;
	int err = read_pnm_header(&text, image, &ascii, problem);

	if (!err)
		err = check_size(reader, image, problem);
	if (err)
		return err;

	size_t need = (size_t)image->width_px * (size_t)image->height_px * (size_t)image->channels;

	if (ascii) {
		image->pixels = reader->decoded;
		return read_ascii(&text, reader->decoded, need, problem);
	}
	if ((size_t)(text.end - text.at) < need) {
		snprintf(problem, IMAGE_PROBLEM_BYTES, "truncated: %zu of %zu bytes of pixels",
			 (size_t)(text.end - text.at), need);
		return -EBADMSG;
	}
	image->pixels = bytes + (text.at - bytes);
	return 0;
}

static int decode(struct image_reader *reader, uint8_t *bytes, size_t size, struct image *out,
		  char problem[IMAGE_PROBLEM_BYTES])
{
	struct image image = {.width_px = reader->width_px, .height_px = reader->height_px};
	int err = image_is_png(bytes, size)
			  ? image_read_png(bytes, size, &image, reader->decoded, problem)
			  : decode_pnm(reader, bytes, size, &image, problem);

	if (!err)
		*out = image;
	return err;
}

/* Reads up to `capacity` bytes; `whole` says that there may not be more. */
static int read_file(const char *path, uint8_t *bytes, size_t capacity, bool whole, size_t *size,
		     char *problem)
{
	struct stat st;
	size_t done = 0;
	int err = 0, fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

	if (fd < 0 || fstat(fd, &st) < 0)
		err = -errno;
	else if (!S_ISREG(st.st_mode))
		err = -ENOTSUP;
	else if (whole && (size_t)st.st_size > capacity)
		err = -EFBIG;
	while (!err && done < capacity) {
		ssize_t n = read(fd, bytes + done, capacity - done);

		if (n > 0)
			done += (size_t)n;
		else if (n == 0)
			break;
		else if (errno != EINTR)
			err = -errno;
	}
	if (fd >= 0)
		close(fd);
	if (err)
		snprintf(problem, IMAGE_PROBLEM_BYTES, "%s",
			 err == -EFBIG     ? "larger than an image of its size can be"
			 : err == -ENOTSUP ? "not a regular file"
					   : strerrordesc_np(-err));
	*size = done;
	return err;
}

int image_probe(const char *path, struct image *out, char problem[IMAGE_PROBLEM_BYTES])
{
	uint8_t bytes[PROBE_BYTES];
	struct image image = {0};
	size_t size;
	bool ascii;
	int err = read_file(path, bytes, sizeof(bytes), false, &size, problem);

	if (err)
		return err;

	struct pnm_text text = {bytes, bytes + size};

	err = image_is_png(bytes, size) ? image_read_png(bytes, size, &image, NULL, problem)
					: read_pnm_header(&text, &image, &ascii, problem);
	if (!err)
		*out = image;
	return err;
}

int image_reader_init(struct image_reader *reader, int width_px, int height_px)
{
	size_t pixels = (size_t)width_px * (size_t)height_px;
	struct image_reader made = {.width_px = width_px, .height_px = height_px};

	made.file_capacity = pixels * P2_PIXEL_BYTES + HEADER_MAX_BYTES;
	made.file = malloc(made.file_capacity);
	made.decoded = malloc(pixels * 3);
	if (!made.file || !made.decoded) {
		image_reader_finish(&made);
		return -ENOMEM;
	}
	*reader = made;
	return 0;
}

void image_reader_finish(struct image_reader *reader)
{
	free(reader->file);
	free(reader->decoded);
	memset(reader, 0, sizeof(*reader));
}

int image_read(struct image_reader *reader, const char *path, struct image *out,
	       char problem[IMAGE_PROBLEM_BYTES])
{
	size_t size;
	int err = read_file(path, reader->file, reader->file_capacity, true, &size, problem);

	return err ? err : decode(reader, reader->file, size, out, problem);
}

void image_make_grey(struct image *image)
{
	size_t count = (size_t)image->width_px * (size_t)image->height_px;
	uint8_t *pixels = image->pixels;

	if (image->channels == 1)
		return;
	for (size_t i = 0; i < count; i++) /* never overtakes what it reads */
		pixels[i] = (uint8_t)((77 * pixels[3 * i] + 150 * pixels[3 * i + 1] +
				       29 * pixels[3 * i + 2] + 128) >>
				      8);
	image->channels = 1;
}
