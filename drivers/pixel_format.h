/*
 * How pixels lie in memory, and what that is called in a config, in the status and over the wire.
 */
#pragma once

#include <stddef.h>

enum pixel_format {
	PIXEL_GREY8,
	PIXEL_RGB8,      /* 3 bytes a pixel */
	PIXEL_BAYER_RG8, /* R G / G B, 1 byte a pixel */
	PIXEL_BAYER_GR8, /* G R / B G */
	PIXEL_BAYER_GB8, /* G B / R G */
	PIXEL_BAYER_BG8, /* B G / G R */
	PIXEL_GREY16,    /* little-endian words; the lowest frame.bits of each are the grey value */
	PIXEL_YUYV,      /* Y U Y V: 2 bytes a pixel, HD only */
	PIXEL_MJPEG, /* one JPEG of frame.size_bytes, HD only: kept as it is, never decoded live */
	PIXEL_FORMAT_COUNT
};

/* "grey", "rgb", "bayer_rg" ... "mjpeg". */
const char *pixel_format_name(enum pixel_format format);

/* 0, or -EINVAL for a name that is none. */
int pixel_format_by_name(enum pixel_format *out, const char *name);

/* A row without padding; of a JPEG the share of a row in the largest that is accepted. */
size_t pixel_row_bytes(enum pixel_format format, int width_px);
