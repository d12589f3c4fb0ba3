/*
 * What a blob's spread says: how long it is, in which direction.
 *
 * A uniform disc of diameter D spreads its light by D2/16 along every axis, seen obliquely less
 * along the short one; lens blur and the pixel add the same to both. Two equal spots s apart spread
 * by s2/4 more along the line between them. None of this depends on the brightness, as an area
 * above a threshold does.
 */
#pragma once

#include <stdbool.h>

#include "track/observe.h"

/* The two axes of a blob's spread; angle_rad of the major one, from x towards y. */
struct blob_axes {
	double major_px2, minor_px2;
	double sigma_px2; /* standard deviation of either */
	double angle_rad;
};

/* Returns false when the blob's spread is not known. */
bool blob_axes(const struct blob *blob, struct blob_axes *out);
