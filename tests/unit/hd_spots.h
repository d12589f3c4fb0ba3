/*
 * Where a marker's spot is in a simulated HD picture, and whether the skin around it lets that be
 * told.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

struct hd_picture {
	const uint8_t *pixels;
	int width_px, height_px;
};

/* A spot beside an eye or on a brow has no background that could be taken off. */
bool hd_spot_is_on_even_skin(const struct hd_picture *picture, const double near[2]);

/* The centre of what shines out of the skin, of green pixels alone: the place whose Gaussian window
 * is balanced. */
void hd_spot_centroid(const struct hd_picture *picture, const double near[2], double out[2]);
