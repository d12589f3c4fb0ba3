/*
 * Colour from a Bayer mosaic, good enough to look at.
 */
#pragma once

#include <stdint.h>

/* RGGB rows without padding to RGB: each missing colour is the mean of its nearest neighbours. */
void demosaic_rggb(const uint8_t *mosaic, int width_px, int height_px, uint8_t *rgb);
