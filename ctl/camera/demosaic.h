/*
 * Colour from a Bayer mosaic, good enough to look at.
 */
#pragma once

#include <stdint.h>

#include "drivers/pixel_format.h"

/* Rows without padding, of one of the Bayer formats, to RGB: each missing colour is the mean of its
 * nearest neighbours. */
void demosaic(const uint8_t *mosaic, int width_px, int height_px, enum pixel_format order,
	      uint8_t *rgb);
