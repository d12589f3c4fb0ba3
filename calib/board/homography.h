/*
 * The plane-to-image map of a board view: h takes (x, y, 1) on the board to the image, row by row.
 * Pure.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Least squares over `count` >= 4 pairs, in normalised coordinates (Hartley 1997); pairs with a NaN
 * are left out. Returns 0, or -EDOM when the places are on a line. */
int homography_fit(double h[9], const double (*from)[2], const double (*to)[2], uint32_t count);

/* False when the place is on or beyond the horizon. */
bool homography_apply(const double h[9], const double from[2], double to[2]);
