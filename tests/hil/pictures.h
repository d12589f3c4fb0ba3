/*
 * What an emulated camera shows: the pictures DIR/000000.pgm, DIR/000001.pgm, ... one after the
 * other and from the beginning again.
 */
#pragma once

#include <stdint.h>

struct pictures {
	int width_px, height_px;
	uint32_t count;
	uint8_t *pixels; /* owned; one picture behind the other, rows without gaps */
};

/* Returns 0 or a negative errno after a message to standard error. finish accepts a zeroed one. */
int pictures_load(struct pictures *out, const char *dir);
void pictures_finish(struct pictures *pictures);

const uint8_t *pictures_get(const struct pictures *pictures, uint64_t exposure);
