/*
 * Pictures of an emulated camera.
 */
#include "tests/hil/pictures.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/image_file.h"

#define PICTURES_MAX 1000

static void path_of(char *path, size_t bytes, const char *dir, uint32_t index)
{
	snprintf(path, bytes, "%s/%06u.pgm", dir, index);
}

static uint32_t count_files(const char *dir)
{
	char path[256];
	uint32_t count = 0;

	do
		path_of(path, sizeof(path), dir, count);
	while (access(path, R_OK) == 0 && ++count < PICTURES_MAX);
	return count;
}

static int read_all(struct pictures *pictures, struct image_reader *reader, const char *dir)
{
	size_t picture_bytes = (size_t)pictures->width_px * pictures->height_px;
	char path[256], problem[IMAGE_PROBLEM_BYTES];
	struct image image;

	for (uint32_t i = 0; i < pictures->count; i++) {
		path_of(path, sizeof(path), dir, i);
		int err = image_read(reader, path, &image, problem);

		if (err) {
			fprintf(stderr, "%s: %s\n", path, problem);
			return err;
		}
		memcpy(pictures->pixels + i * picture_bytes, image.pixels, picture_bytes);
	}
	return 0;
}

int pictures_load(struct pictures *out, const char *dir)
{
	char path[256], problem[IMAGE_PROBLEM_BYTES] = "not grey";
	struct image_reader reader = {0};
	struct image first;

	path_of(path, sizeof(path), dir, 0);
	int err = image_probe(path, &first, problem);

	if (!err && first.channels != 1)
		err = -EINVAL;
	if (err) {
		fprintf(stderr, "%s: %s\n", path, problem);
		return err;
	}
	struct pictures pictures = {.width_px = first.width_px,
				    .height_px = first.height_px,
				    .count = count_files(dir)};

	pictures.pixels = malloc((size_t)first.width_px * first.height_px * pictures.count);
	err = image_reader_init(&reader, first.width_px, first.height_px);
	if (!err)
		err = pictures.pixels ? read_all(&pictures, &reader, dir) : -ENOMEM;
	image_reader_finish(&reader);
	if (err) {
		pictures_finish(&pictures);
		return err;
	}
	*out = pictures;
	return 0;
}

void pictures_finish(struct pictures *pictures)
{
	free(pictures->pixels);
	*pictures = (struct pictures){0};
}

const uint8_t *pictures_get(const struct pictures *pictures, uint64_t exposure)
{
	size_t picture_bytes = (size_t)pictures->width_px * pictures->height_px;

	return pictures->pixels + exposure % pictures->count * picture_bytes;
}
