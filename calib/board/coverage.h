/*
 * What the views of a board show so far, camera by camera, and what is missing: for the operator
 * who waves. Pure.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "calib/board/observations.h"

#define COVERAGE_COLUMNS 12
#define COVERAGE_ROWS 6

enum coverage_side { SIDE_LEFT, SIDE_RIGHT, SIDE_UP, SIDE_DOWN, SIDE_COUNT };

struct camera_coverage {
	uint32_t views;
	uint32_t cells[COVERAGE_ROWS][COVERAGE_COLUMNS]; /* corners in each part of the image */
	double part;                                     /* of these cells that have corners */
	uint32_t tilted[SIDE_COUNT]; /* views in which the board leans that way by 15 degrees */
	double tilt_deg;             /* the widest tilt of a view; NaN: cannot be told yet */
	uint32_t links[CAMERA_MAX];  /* poses that it saw together with each other camera */
	uint32_t linked;             /* cameras that it has links enough to */
};

/* `cameras` has a place for each of the observations'. Returns 0 or -ENOMEM. */
int coverage_find(struct camera_coverage *cameras, const struct observations *observations);

#define COVERAGE_WORDS_BYTES 256

/* Enough to stop waving: views and links, most of the image, tilts to most sides. What is missing
 * beyond that would make it better. `alone`: there is no other camera. */
bool coverage_enough(const struct camera_coverage *camera, bool alone);

/* How near that is: 0 to 1, and 1 only when it is. */
double coverage_progress(const struct camera_coverage *camera, bool alone);

/* "upper left", "middle": of the nine regions of an image. */
const char *coverage_region_name(const struct observed_camera *camera, const double px[2]);

/* "upper left, tilted to the right"; "" when nothing is. */
void coverage_missing(const struct camera_coverage *camera, bool alone,
		      char words[COVERAGE_WORDS_BYTES]);
