/*
 * Pixel formats: which of GenICam's are ours, and which a camera is set to. Packed ones, whose
 * pixels share bytes, are none: cameras that have them have unpacked ones too.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "drivers/aravis/aravis_device.h"

static const struct aravis_format known[] = {
	{ARV_PIXEL_FORMAT_MONO_8, PIXEL_GREY8, 0},
	{ARV_PIXEL_FORMAT_MONO_12, PIXEL_GREY16, 12},
	{ARV_PIXEL_FORMAT_MONO_10, PIXEL_GREY16, 10},
	{ARV_PIXEL_FORMAT_MONO_14, PIXEL_GREY16, 14},
	{ARV_PIXEL_FORMAT_MONO_16, PIXEL_GREY16, 16},
	{ARV_PIXEL_FORMAT_BAYER_RG_8, PIXEL_BAYER_RG8, 0},
	{ARV_PIXEL_FORMAT_BAYER_GR_8, PIXEL_BAYER_GR8, 0},
	{ARV_PIXEL_FORMAT_BAYER_GB_8, PIXEL_BAYER_GB8, 0},
	{ARV_PIXEL_FORMAT_BAYER_BG_8, PIXEL_BAYER_BG8, 0},
	{ARV_PIXEL_FORMAT_RGB_8_PACKED, PIXEL_RGB8, 0},
};

#define KNOWN_COUNT (sizeof(known) / sizeof(known[0]))

/* What may stand in for a format that the caller leaves to the device, best first. */
static const enum pixel_format for_grey[] = {PIXEL_GREY8, PIXEL_GREY16};
static const enum pixel_format for_colour[] = {PIXEL_BAYER_RG8, PIXEL_BAYER_GR8, PIXEL_BAYER_GB8,
					       PIXEL_BAYER_BG8, PIXEL_RGB8,      PIXEL_GREY8};

struct offer {
	gint64 *codes;
	guint count;
};

static bool offers(const struct offer *offer, ArvPixelFormat code)
{
	for (guint i = 0; i < offer->count; i++)
		if (offer->codes[i] == (gint64)code)
			return true;
	return false;
}

static const struct aravis_format *find(const struct offer *offer, enum pixel_format format,
					int bits)
{
	for (size_t k = 0; k < KNOWN_COUNT; k++)
		if (known[k].format == format && offers(offer, known[k].code) &&
		    (format != PIXEL_GREY16 || !bits || bits == known[k].bits))
			return &known[k];
	return NULL;
}

static const struct aravis_format *choose(const struct offer *offer,
					  const struct camera_mode *wanted)
{
	bool grey = wanted->format == PIXEL_GREY8, colour = wanted->format == PIXEL_BAYER_RG8;
	const enum pixel_format *list = grey ? for_grey : colour ? for_colour : &wanted->format;
	size_t count = grey     ? sizeof(for_grey) / sizeof(*list)
		       : colour ? sizeof(for_colour) / sizeof(*list)
				: 1;
	const struct aravis_format *found = NULL;

	for (size_t i = 0; i < count && !found; i++)
		found = find(offer, list[i], wanted->bits);
	return found;
}

static int refuse(ArvCamera *device, const char *address, enum pixel_format wanted,
		  struct diag *diag)
{
	char list[512] = "";
	guint count = 0;
	const char **names =
		arv_camera_dup_available_pixel_formats_as_strings(device, &count, NULL);

	for (guint i = 0; i < count && strlen(list) + strlen(names[i]) + 3 < sizeof(list); i++)
		snprintf(list + strlen(list), sizeof(list) - strlen(list), "%s%s", i ? ", " : "",
			 names[i]);
	g_free(names);
	diag_add(diag,
		 "%s: pixel format: %s is wanted, the camera offers %s; grey comes from Mono8, and "
		 "from Mono10 to Mono16 unpacked, colour (role hd) from Bayer 8 bit and RGB8",
		 address, pixel_format_name(wanted), *list ? list : "none that it names");
	return -ENOTSUP;
}

int aravis_set_format(ArvCamera *device, const char *address, const struct camera_mode *wanted,
		      struct aravis_format *chosen, struct diag *diag)
{
	struct offer offer = {0};
	GError *error = NULL;

	offer.codes = arv_camera_dup_available_pixel_formats(device, &offer.count, NULL);
	const struct aravis_format *format = choose(&offer, wanted);

	g_free(offer.codes);
	if (!format)
		return refuse(device, address, wanted->format, diag);
	if (arv_camera_get_pixel_format(device, NULL) != format->code)
		arv_camera_set_pixel_format(device, format->code, &error);
	if (error)
		return aravis_fail(&error, -EIO, address, "pixel format", diag);
	if (arv_camera_get_pixel_format(device, NULL) != format->code)
		return refuse(device, address, wanted->format, diag);
	*chosen = *format;
	return 0;
}
