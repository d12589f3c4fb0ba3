/*
 * Between the two files of pressed lips: match_pressed.c looks for the spots, match_pressed_fit.c
 * fits the way from one marker to the other to them.
 */
#pragma once

#include "track/match/match_parts.h"

/* One camera's spot of the two. */
struct pressed_spot {
	int blob;
	bool share_known;
	double share;
	double line[2], line_px; /* from the first to the second */
	double longer_px2[2];    /* xx - yy and 2 xy of what its spread says of the line */
	double ratio;            /* of that along the line, over what was expected */
};

struct pressed_spots {
	int count;
	uint32_t camera[CAMERA_MAX];
	struct pressed_spot spot[CAMERA_MAX];
	uint32_t apart_mask; /* cameras that have a spot for each */
	double apart_px[CAMERA_MAX][2], apart_sigma_px[CAMERA_MAX];
};

/* Of a vector in space at the projected place: how far along the image's axis, in pixels. */
static inline double project_slope(const struct projection *q, int axis, struct vec3 d)
{
	const double *slope = q->slopes[axis];

	return slope[0] * d.x + slope[1] * d.y + slope[2] * d.z;
}

/* The median; sorts the values. For few of them: unlike qsort() it never allocates. */
double pressed_median(double *values, int count);

/* Fits the way from one marker to the other, leaning on where it was expected. */
bool pressed_fit(const struct matcher *matcher, const struct pressed_spots *spots,
		 struct vec3 expected_m, struct pressed *pressed);

/* Not as they were expected, but most spots by themselves, and all less what it takes to have the
 * two there, are better explained by them than by one marker. */
bool pressed_are_plainly_two(const struct matcher *matcher, const struct pressed_spots *spots,
			     struct vec3 expected_m, const struct pressed *pressed);
