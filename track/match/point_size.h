/*
 * How large a point's light is, from how far its spots spread in the images: a disc of diameter D
 * seen squarely spreads by D2/16 along either axis, and lens blur adds what the named markers of
 * each camera, whose diameters the layout has, tell. Sizes that differ by more than twice part a
 * body's markers from a face's, and both from lamps and reflections. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/match/match.h"

/* Its square, and the standard deviation of that. */
struct point_size {
	double diameter2_m2, sigma_m2; /* sigma 0: not known */
};

/* Not known when every view of it is merged, clipped or at the border, or too young to judge. */
struct point_size point_size(const struct matcher *matcher, const struct view_blur *blur,
			     const struct point *point);

/* The point is of another size class than a marker of this diameter: surely twice as large or more,
 * or half as large or less. */
bool point_size_is_larger(const struct point_size *size, double diameter_m);
bool point_size_is_smaller(const struct point_size *size, double diameter_m);
bool point_size_fits(const struct point_size *size, double diameter_m);

/* What the lenses add, by the named points of a shot. Nothing where the layout has one diameter for
 * all markers: then no size is known. */
void point_size_learn(struct tracker_state *state, const struct matcher *matcher);
