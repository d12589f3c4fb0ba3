/*
 * Any bytes as an image of a recording, first probed for its size, then read at that size (or at
 * 40x32, which the corpus has).
 */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/image_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

static void touch(const struct image *image)
{
	volatile unsigned sum = 0;
	size_t count = (size_t)image->width_px * (size_t)image->height_px * (size_t)image->channels;

	for (size_t i = 0; i < count; i++)
		sum += image->pixels[i];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	char problem[IMAGE_PROBLEM_BYTES] = "";
	const char *path = memory_file(data, size);
	struct image image = {0};
	struct image_reader reader;

	if (image_probe(path, &image, problem) != 0) {
		assert(*problem);
		image.width_px = 40;
		image.height_px = 32;
	}
	if ((long)image.width_px * image.height_px > 1 << 20)
		return 0;
	if (image_reader_init(&reader, image.width_px, image.height_px))
		abort();
	if (image_read(&reader, path, &image, problem) == 0) {
		touch(&image);
		image_make_grey(&image);
		touch(&image);
	} else {
		assert(*problem);
	}
	image_reader_finish(&reader);
	return 0;
}
