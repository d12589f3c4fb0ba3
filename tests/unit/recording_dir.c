/*
 * See recording_dir.h.
 */
#include "recording_dir.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"

char dir[] = "/tmp/drivers_filesXXXXXX";
struct camera *camera;
struct camera_mode granted;

const char *in_dir(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "%s/%s", dir, name);
	return path;
}

void write_bytes(const char *name, const void *bytes, size_t size)
{
	FILE *file = fopen(in_dir(name), "w");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, size, file), size);
	assert_int_equal(fclose(file), 0);
}

void write_text(const char *name, const char *text)
{
	write_bytes(name, text, strlen(text));
}

uint8_t grey_at(int x, int y, int image)
{
	return (uint8_t)(x * 3 + y * 5 + image);
}

/* P5 or P6; the RGB pixels are (grey, grey, grey). */
void write_pnm(const char *name, int channels, int image)
{
	uint8_t bytes[64 + WIDTH_PX * HEIGHT_PX * 3];
	int used = sprintf((char *)bytes, "P%d\n# a comment\n%d %d\n255\n", channels == 3 ? 6 : 5,
			   WIDTH_PX, HEIGHT_PX);

	for (int y = 0; y < HEIGHT_PX; y++)
		for (int x = 0; x < WIDTH_PX; x++)
			for (int c = 0; c < channels; c++)
				bytes[used++] = grey_at(x, y, image);
	write_bytes(name, bytes, (size_t)used);
}

void write_png(const char *name, int colour_type, int depth, int image)
{
	png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
	png_infop info = png_create_info_struct(png);
	const png_color palette[2] = {{0, 0, 0}, {255, 255, 255}};
	uint8_t row[WIDTH_PX * 8] = {0};
	FILE *file = fopen(in_dir(name), "w");
	int channels = colour_type == PNG_COLOR_TYPE_RGB    ? 3
		       : colour_type == PNG_COLOR_TYPE_RGBA ? 4
							    : 1;

	assert_non_null(file);
	png_init_io(png, file);
	png_set_IHDR(png, info, WIDTH_PX, HEIGHT_PX, depth, colour_type, PNG_INTERLACE_NONE,
		     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
	if (colour_type == PNG_COLOR_TYPE_PALETTE)
		png_set_PLTE(png, info, palette, 2);
	png_set_gAMA(png, info, 0.3); /* must not change a pixel */
	png_write_info(png, info);
	for (int y = 0; y < HEIGHT_PX; y++) {
		for (int x = 0; x < WIDTH_PX * channels; x++)
			row[x] = colour_type == PNG_COLOR_TYPE_PALETTE
					 ? 0
					 : grey_at(x / channels, y, image);
		png_write_row(png, row);
	}
	png_write_end(png, info);
	png_destroy_write_struct(&png, &info);
	fclose(file);
}

int open_camera(const struct camera_driver *driver, struct diag *diag)
{
	int err = driver->open(&camera, dir + strlen("/tmp/"), "/tmp", diag);

	return err;
}

void start_with(const struct camera_driver *driver, enum pixel_format format)
{
	const struct camera_mode wanted = {.format = format};
	struct diag diag = {0};

	assert_int_equal(open_camera(driver, &diag), 0);
	assert_int_equal(driver->configure(camera, &wanted, &granted, &diag), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	assert_null(diag.text);
}

void finish(void)
{
	camera->driver->stop(camera);
	camera->driver->close(camera);
	camera = NULL;
}

int next(struct frame *frame)
{
	return camera->driver->acquire(camera, NS_PER_S, frame);
}

void expect_grey(const struct frame *frame, int image)
{
	assert_int_equal(frame->format, PIXEL_GREY8);
	assert_int_equal(frame->width_px, WIDTH_PX);
	assert_int_equal(frame->height_px, HEIGHT_PX);
	for (int y = 0; y < HEIGHT_PX; y++)
		for (int x = 0; x < WIDTH_PX; x++)
			assert_int_equal(frame->pixels[y * frame->stride_bytes + x],
					 grey_at(x, y, image));
}

int make_dir(void **state)
{
	(void)state;
	return mkdtemp(dir) ? 0 : -1;
}

int remove_dir(void **state)
{
	char command[64];

	(void)state;
	snprintf(command, sizeof(command), "rm -r %s", dir);
	return system(command);
}
