/*
 * The table of pixel formats.
 */
#include "drivers/pixel_format.h"

#include <errno.h>
#include <string.h>

static const struct {
	const char *name;
	size_t pixel_bytes;
} formats[PIXEL_FORMAT_COUNT] = {
	[PIXEL_GREY8] = {"grey", 1},         [PIXEL_RGB8] = {"rgb", 3},
	[PIXEL_BAYER_RG8] = {"bayer_rg", 1}, [PIXEL_BAYER_GR8] = {"bayer_gr", 1},
	[PIXEL_BAYER_GB8] = {"bayer_gb", 1}, [PIXEL_BAYER_BG8] = {"bayer_bg", 1},
	[PIXEL_GREY16] = {"grey16", 2},      [PIXEL_YUYV] = {"yuyv", 2},
	[PIXEL_MJPEG] = {"mjpeg", 2}, /* what USB cameras reserve for one */
};

const char *pixel_format_name(enum pixel_format format)
{
	return formats[format].name;
}

int pixel_format_by_name(enum pixel_format *out, const char *name)
{
	for (int f = 0; f < PIXEL_FORMAT_COUNT; f++)
		if (strcmp(formats[f].name, name) == 0) {
			*out = (enum pixel_format)f;
			return 0;
		}
	return -EINVAL;
}

size_t pixel_row_bytes(enum pixel_format format, int width_px)
{
	return formats[format].pixel_bytes * (size_t)width_px;
}
