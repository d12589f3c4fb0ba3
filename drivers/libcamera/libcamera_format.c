/*
 * The table of formats. Names tell the order in a word, not in memory: BGR888 is R, G, B there. Raw
 * formats of one name with and without CSI2P are the same pixels, packed as they come from the bus.
 */
#include "drivers/libcamera/libcamera_format.h"

#include <string.h>

static const struct libcamera_format known[] = {
	{"R8", PIXEL_GREY8, 0, PACKING_NONE},
	{"R12", PIXEL_GREY16, 12, PACKING_NONE},
	{"R10", PIXEL_GREY16, 10, PACKING_NONE},
	{"R16", PIXEL_GREY16, 16, PACKING_NONE},
	{"R12_CSI2P", PIXEL_GREY16, 12, PACKING_12},
	{"R10_CSI2P", PIXEL_GREY16, 10, PACKING_10},
	{"NV12", PIXEL_GREY8, 0, PACKING_NONE}, /* its first plane is the luma */
	{"YUYV", PIXEL_GREY8, 0, PACKING_LUMA},
	{"SRGGB8", PIXEL_BAYER_RG8, 0, PACKING_NONE},
	{"SGRBG8", PIXEL_BAYER_GR8, 0, PACKING_NONE},
	{"SGBRG8", PIXEL_BAYER_GB8, 0, PACKING_NONE},
	{"SBGGR8", PIXEL_BAYER_BG8, 0, PACKING_NONE},
	{"SRGGB10_CSI2P", PIXEL_BAYER_RG8, 0, PACKING_10_HIGH_8},
	{"SGRBG10_CSI2P", PIXEL_BAYER_GR8, 0, PACKING_10_HIGH_8},
	{"SGBRG10_CSI2P", PIXEL_BAYER_GB8, 0, PACKING_10_HIGH_8},
	{"SBGGR10_CSI2P", PIXEL_BAYER_BG8, 0, PACKING_10_HIGH_8},
	{"SRGGB12_CSI2P", PIXEL_BAYER_RG8, 0, PACKING_12_HIGH_8},
	{"SGRBG12_CSI2P", PIXEL_BAYER_GR8, 0, PACKING_12_HIGH_8},
	{"SGBRG12_CSI2P", PIXEL_BAYER_GB8, 0, PACKING_12_HIGH_8},
	{"SBGGR12_CSI2P", PIXEL_BAYER_BG8, 0, PACKING_12_HIGH_8},
	{"MJPEG", PIXEL_MJPEG, 0, PACKING_NONE},
	{"YUYV", PIXEL_YUYV, 0, PACKING_NONE},
	{"BGR888", PIXEL_RGB8, 0, PACKING_NONE},
};

#define KNOWN_COUNT (sizeof(known) / sizeof(known[0]))

void libcamera_format_add(struct libcamera_offers *offers, bool raw, const char *name, int width_px,
			  int height_px)
{
	for (size_t k = 0; k < KNOWN_COUNT; k++)
		if (strcmp(known[k].name, name) == 0 && offers->count < LIBCAMERA_OFFERS_MAX)
			offers->offers[offers->count++] =
				(struct libcamera_offer){&known[k], raw, width_px, height_px};
}

static bool is_bayer(enum pixel_format format)
{
	return format >= PIXEL_BAYER_RG8 && format <= PIXEL_BAYER_BG8;
}

/* Whether a format may be granted for a wanted one: PIXEL_GREY8 and PIXEL_BAYER_RG8 stand for what
 * serves best. */
static bool serves(const struct libcamera_format *format, const struct camera_mode *wanted)
{
	if (format->format == PIXEL_GREY16 && wanted->bits && format->bits != wanted->bits)
		return false;
	if (wanted->format == PIXEL_GREY8 && format->format == PIXEL_GREY16)
		return true;
	if (wanted->format == PIXEL_BAYER_RG8)
		return is_bayer(format->format) || format->format == PIXEL_MJPEG ||
		       format->format == PIXEL_YUYV || format->format == PIXEL_RGB8 ||
		       (format->format == PIXEL_GREY8 && format->packing == PACKING_NONE);
	return format->format == wanted->format;
}

/* Less is better: the table's order, but that grey is the last resort for colour. */
static int rank(const struct libcamera_format *format, const struct camera_mode *wanted)
{
	int place = (int)(format - known);

	if (wanted->format != PIXEL_GREY8 && format->format == PIXEL_GREY8)
		place += (int)KNOWN_COUNT;
	return place;
}

static const struct libcamera_format *best_format(const struct libcamera_offers *offers,
						  const struct camera_mode *wanted)
{
	const struct libcamera_format *best = NULL;

	for (int i = 0; i < offers->count; i++) {
		const struct libcamera_format *format = offers->offers[i].format;

		if (serves(format, wanted) && (!best || rank(format, wanted) < rank(best, wanted)))
			best = format;
	}
	return best;
}

/* What is offered raw and processed is first offered raw. */
const struct libcamera_offer *libcamera_format_choose(const struct libcamera_offers *offers,
						      const struct camera_mode *wanted)
{
	const struct libcamera_format *format = best_format(offers, wanted);

	for (int i = 0; i < offers->count; i++)
		if (offers->offers[i].format == format)
			return &offers->offers[i];
	return NULL;
}

size_t libcamera_packed_row_bytes(const struct libcamera_format *format, int width_px)
{
	size_t width = (size_t)width_px;

	switch (format->packing) {
	case PACKING_LUMA:
		return 2 * width;
	case PACKING_10:
	case PACKING_10_HIGH_8:
		return (width + 3) / 4 * 5;
	case PACKING_12:
	case PACKING_12_HIGH_8:
		return (width + 1) / 2 * 3;
	case PACKING_NONE:
		break;
	}
	return pixel_row_bytes(format->format, width_px);
}

static void put_word(uint8_t *to, int x, unsigned int value)
{
	to[2 * x] = (uint8_t)value;
	to[2 * x + 1] = (uint8_t)(value >> 8);
}

/* In a group the upper eight bits of every pixel come first, then the lower ones of all, those of
 * the first pixel lowest. */
static void unpack_words(const uint8_t *from, uint8_t *to, int width_px, int group_px, int low_bits)
{
	for (int x = 0; x < width_px; x += group_px, from += group_px + 1)
		for (int i = 0; i < group_px && x + i < width_px; i++) {
			unsigned int low = from[group_px] >> (i * low_bits);

			put_word(to, x + i,
				 (unsigned int)from[i] << low_bits |
					 (low & ((1u << low_bits) - 1)));
		}
}

static void keep_high(const uint8_t *from, uint8_t *to, int width_px, int group_px)
{
	for (int x = 0; x < width_px; x += group_px, from += group_px + 1)
		for (int i = 0; i < group_px && x + i < width_px; i++)
			to[x + i] = from[i];
}

void libcamera_unpack_row(enum libcamera_packing packing, const uint8_t *from, uint8_t *to,
			  int width_px)
{
	switch (packing) {
	case PACKING_LUMA:
		for (int x = 0; x < width_px; x++)
			to[x] = from[2 * x];
		break;
	case PACKING_10:
		unpack_words(from, to, width_px, 4, 2);
		break;
	case PACKING_12:
		unpack_words(from, to, width_px, 2, 4);
		break;
	case PACKING_10_HIGH_8:
		keep_high(from, to, width_px, 4);
		break;
	case PACKING_12_HIGH_8:
		keep_high(from, to, width_px, 2);
		break;
	case PACKING_NONE:
		memcpy(to, from, (size_t)width_px);
		break;
	}
}
