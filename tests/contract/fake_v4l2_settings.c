/*
 * A fake camera's file: what it is, and what it does wrong.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/contract/fake_v4l2_parts.h"

int fake_pixel_bytes(uint32_t fourcc)
{
	return fourcc == V4L2_PIX_FMT_Y10 || fourcc == V4L2_PIX_FMT_Y12 ||
			       fourcc == V4L2_PIX_FMT_Y16 || fourcc == V4L2_PIX_FMT_YUYV ||
			       fourcc == V4L2_PIX_FMT_MJPEG
		       ? 2
		       : 1;
}

uint32_t fake_fourcc(const char *text)
{
	char code[5] = "    ";

	memcpy(code, text, strcspn(text, ",") < 4 ? strcspn(text, ",") : 4);
	return v4l2_fourcc(code[0], code[1], code[2], code[3]);
}

const char *fake_nth_format(const struct fake *fake, uint32_t index)
{
	const char *at = fake->formats;

	while (at && index-- > 0) {
		at = strchr(at, ',');
		at = at ? at + 1 : NULL;
	}
	return at;
}

static void set_defaults(struct fake *fake)
{
	strcpy(fake->card, "Fake camera");
	strcpy(fake->driver, "fake");
	strcpy(fake->formats, "GREY");
	strcpy(fake->stamps, "soe");
	fake->width = 160;
	fake->height = 120;
	fake->period_us = 10000;
	fake->exposure_us = 1000;
	fake->readout_us = 4000;
}

static void set_one(struct fake *fake, const char *key, const char *value)
{
#define TEXT(field)                       \
	{                                 \
#field, fake->field, NULL \
	}
#define NUMBER(field)                      \
	{                                  \
#field, NULL, &fake->field \
	}
	const struct {
		const char *key;
		char *text;
		long *number;
	} keys[] = {
		TEXT(card),          TEXT(driver),          TEXT(formats),
		TEXT(stamps),        NUMBER(width),         NUMBER(height),
		NUMBER(stride),      NUMBER(period_us),     NUMBER(exposure_us),
		NUMBER(readout_us),  NUMBER(error_every),   NUMBER(gap_every),
		NUMBER(short_every), NUMBER(eio_after),     NUMBER(quiet),
		NUMBER(still),       NUMBER(cannot_stream), NUMBER(metadata),
		NUMBER(denied),      NUMBER(busy),          NUMBER(planes),
		NUMBER(offset),      NUMBER(hblank),        NUMBER(pixel_rate),
	};

	if (strcmp(key, "jpeg") == 0)
		snprintf(fake->jpeg, sizeof(fake->jpeg), "%s", value);
	for (size_t k = 0; k < sizeof(keys) / sizeof(keys[0]); k++)
		if (strcmp(keys[k].key, key) == 0 && keys[k].text)
			snprintf(keys[k].text, 64, "%.63s", value);
		else if (strcmp(keys[k].key, key) == 0)
			*keys[k].number = atol(value);
}

void fake_set_format(struct fake *fake, uint32_t fourcc)
{
	fake->fourcc = fourcc;
	long row_bytes = fake->width * fake_pixel_bytes(fourcc);

	if (fake->stride < row_bytes)
		fake->stride = row_bytes;
	fake->size_bytes = (uint32_t)(fake->stride * fake->height + fake->offset);
}

bool fake_read_settings(struct fake *fake)
{
	char line[400], key[64], value[256];
	FILE *file = fopen(fake->path, "r");

	if (!file)
		return false;
	set_defaults(fake);
	while (fgets(line, sizeof(line), file))
		if (sscanf(line, "%63s %255[^\n]", key, value) == 2)
			set_one(fake, key, value);
	fclose(file);
	fake->full_width = fake->width;
	fake->full_height = fake->height;
	fake_set_format(fake, fake_fourcc(fake->formats));
	return true;
}
