/*
 * Which of libcamera's pixel formats are ours, and how rows of those that are not in place become
 * rows that are. Pure; real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/camera.h"

enum libcamera_packing {
	PACKING_NONE,      /* read in place */
	PACKING_LUMA,      /* every second byte of YUYV */
	PACKING_10,        /* 4 pixels in 5 bytes (MIPI CSI-2), to words */
	PACKING_12,        /* 2 pixels in 3 bytes, to words */
	PACKING_10_HIGH_8, /* ... of which the upper 8 bits are kept */
	PACKING_12_HIGH_8,
};

struct libcamera_format {
	const char *name; /* libcamera's */
	enum pixel_format format;
	int bits; /* as in struct frame */
	enum libcamera_packing packing;
};

#define LIBCAMERA_OFFERS_MAX 256

/* One size of one of a camera's formats. */
struct libcamera_offer {
	const struct libcamera_format *format;
	bool raw;
	int width_px, height_px;
};

struct libcamera_offers {
	int count;
	struct libcamera_offer offers[LIBCAMERA_OFFERS_MAX];
};

/* libcamera's formats that are of use here, best first, with each of those of that name. */
void libcamera_format_add(struct libcamera_offers *offers, bool raw, const char *name, int width_px,
			  int height_px);

/* The best format for what is wanted, as it was offered first; NULL when there is none. */
const struct libcamera_offer *libcamera_format_choose(const struct libcamera_offers *offers,
						      const struct camera_mode *wanted);

/* Bytes of a row before it is unpacked, without padding. */
size_t libcamera_packed_row_bytes(const struct libcamera_format *format, int width_px);

/* A row of `width_px` as libcamera has it to one in format->format. */
void libcamera_unpack_row(enum libcamera_packing packing, const uint8_t *from, uint8_t *to,
			  int width_px);
