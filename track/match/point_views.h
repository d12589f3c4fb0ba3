/*
 * What the views of a point are worth: whether they may give it a name. When all points are found.
 * Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/match/match.h"

/* Most of them see two markers in one spot, which is not parted. */
bool point_is_merged(const struct matcher *matcher, const struct point *point);

/* Spots of two markers alone show it, and fewer than three of them surely. */
bool point_is_unsure(const struct matcher *matcher, const struct point *point);

/* They hardly agree on one place, fewer than three of them tell much, or all are halves of spots:
 * two markers of which one is elsewhere make such too. */
bool point_is_strained(const struct matcher *matcher, const struct point *point);
