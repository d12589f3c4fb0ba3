/*
 * One camera's pictures, searched for the board one after the other, by one thread at a time; and
 * what all cameras found, put together.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "calib/board/corners.h"
#include "calib/board/observations.h"
#include "ctl/camera/picture_grey.h"

/* What became of a camera's pictures. */
struct picture_counts {
	uint32_t pictures;                           /* searched */
	uint32_t good, without, few, blurred, other; /* enum corners_state */
	uint32_t unchanged; /* not searched: they show what the last one showed */
	uint32_t skipped;   /* live: not looked at, because a newer one was there */
	uint32_t damaged;   /* could not be read, or of another size than the first */
	uint32_t apart;     /* good, but exposed at another time than the shot's other cameras */
	double apart_ms;    /* of the worst of these */
	double blur_px;     /* median of good and blurred ones; NaN without */
	bool mirrored;
	int width_px, height_px;
};

struct view_search_settings {
	double blur_max_px;
	bool thorough; /* every picture, at its own size; else as much as live search needs */
};

struct found_view;

struct view_search {
	struct view_search_settings settings;
	uint32_t camera;
	uint32_t corner_count;
	struct corner_finder *finder; /* owned */
	struct grey_room grey;        /* owned */
	bool small;               /* this camera's board is read at the picture's own size alone */
	uint8_t *last;            /* owned; a few pixels of the picture searched last */
	struct corners corners;   /* of the last one */
	struct found_view *found; /* owned */
	uint32_t found_count, found_capacity;
	double *blurs_px; /* owned */
	uint32_t blur_count, blur_capacity;
	struct picture_counts counts;
};

/* `camera` is its number in the observations. Returns 0 or a negative errno. */
int view_search_init(struct view_search *search, uint32_t camera, const struct board *board,
		     const struct view_search_settings *settings);
void view_search_finish(struct view_search *search); /* a zeroed one is fine */

/* Searches one picture and counts it. Cameras of the same shot (UINT64_MAX: not known) that were
 * exposed within 0.2 ms see the board in the same pose. Returns 0 or -ENOMEM. */
int view_search_run(struct view_search *search, const struct frame *frame);

/* Adds what all found, in an order that does not depend on threads, to `observations`, which are
 * empty; `counts` gets a place per camera. Returns 0 or a negative errno. */
int views_put_together(struct observations *observations, struct view_search *const *searches,
		       struct picture_counts *counts);
