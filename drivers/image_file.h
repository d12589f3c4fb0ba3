/*
 * Still images of 8 bits a channel, grey or RGB: PNM (P2, P5, P6) and PNG. Files come from outside:
 * sizes are bounded, and anything else (16 bits, palette, transparency, interlacing) is refused
 * in words.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#define IMAGE_SIZE_MAX_PX 16384
#define IMAGE_PROBLEM_BYTES 160

struct image {
	int width_px, height_px;
	int channels;    /* 1 grey, 3 RGB */
	uint8_t *pixels; /* rows without gaps; the reader's until its next image */
};

/* Memory for images of one size. Reading with it does not allocate, except libpng for a PNG. */
struct image_reader {
	int width_px, height_px;
	uint8_t *file, *decoded; /* owned */
	size_t file_capacity;
};

/* Finds the size of the image in `path`; `pixels` is NULL. Returns 0, -EBADMSG or the errno of
 * reading it; then `problem` says why, without the path. */
int image_probe(const char *path, struct image *out, char problem[IMAGE_PROBLEM_BYTES]);

/* Returns 0 or -ENOMEM. finish accepts a zeroed reader. */
int image_reader_init(struct image_reader *reader, int width_px, int height_px);
void image_reader_finish(struct image_reader *reader);

/* Reads the image in `path`, which must have the reader's size. Errors as image_probe. */
int image_read(struct image_reader *reader, const char *path, struct image *out,
	       char problem[IMAGE_PROBLEM_BYTES]);

/* Makes RGB grey (ITU-R BT.601 luma, rounded) in place; a grey image stays as it is. */
void image_make_grey(struct image *image);
