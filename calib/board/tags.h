/*
 * The board's tags in a picture, by libapriltag (Wang and Olson 2016). Its pixels become ours here,
 * and nowhere else: it has (0.5, 0.5) where we have (0, 0), at the centre of the top-left pixel.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "config/board.h"
#include "track/blobs/blobs.h"

#define TAG_COUNT_MAX ((BOARD_SQUARES_MAX * BOARD_SQUARES_MAX + 1) / 2)

struct tag {
	bool found;
	double h[9]; /* places on the board, metres, to pixels; good near the tag */
};

struct tags {
	uint32_t found_count;
	uint32_t foreign_count;         /* with identities that the board has not */
	struct tag tags[TAG_COUNT_MAX]; /* by identity less board.first_id */
};

struct tag_finder; /* one thread's */

/* Returns 0 or -ENOMEM. */
int tag_finder_create(struct tag_finder **out, const struct board *board);
void tag_finder_destroy(struct tag_finder *finder); /* accepts NULL */

/* Searches the picture at 1/`decimate` of its size; identities are read at its own. Returns 0 or
 * -ENOMEM. */
int tag_finder_run(struct tag_finder *finder, const struct grey_image *image, int decimate,
		   struct tags *tags);
