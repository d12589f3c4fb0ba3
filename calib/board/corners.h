/*
 * Finds the board in a picture: tags by libapriltag (Wang and Olson 2016) say which square is
 * where, the checkerboard's own corners, more exact than any tag's, are what is measured. Each
 * thread has its own finder.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "config/board.h"
#include "track/blobs/blobs.h"

struct corner_finder;

struct corner_settings {
	double blur_max_px;   /* of the edges, one sigma: a view with more is refused */
	uint32_t corners_min; /* of a view */
	/* Few tags in the picture at half its size: it is searched at its own, which takes 200 ms.
	 * For boards whose squares are under 30 px. */
	bool thorough;
};

#define CORNER_SETTINGS_DEFAULT \
	((struct corner_settings){.blur_max_px = 2.0, .corners_min = 12, .thorough = true})

enum corners_state {
	CORNERS_GOOD,
	CORNERS_NO_BOARD,    /* no tag of it was found */
	CORNERS_FEW,         /* too few corners */
	CORNERS_BLURRED,     /* out of focus or moved */
	CORNERS_OTHER_BOARD, /* tags of another board, or in other places than it has them */
};

struct corners {
	enum corners_state state;
	uint32_t tag_count;             /* of the board */
	uint32_t foreign_count;         /* tags with identities that the board has not */
	uint32_t found_count;           /* corners */
	double blur_px;                 /* median of the edges' larger sigma; 0: no corner */
	double square_px;               /* median edge of a square */
	double px[BOARD_CORNER_MAX][2]; /* NaN: not found; (0,0) is the top-left pixel's centre */
};

/* Returns 0, -ENOMEM, or -EINVAL for a board that board_check() refuses. */
int corner_finder_create(struct corner_finder **out, const struct board *board,
			 const struct corner_settings *settings);
void corner_finder_destroy(struct corner_finder *finder); /* accepts NULL */

/* Of the pictures from now on. */
void corner_finder_set_thorough(struct corner_finder *finder, bool thorough);

/* Returns 0 or -ENOMEM. Whatever the state, all corners that were found are there. */
int corner_finder_run(struct corner_finder *finder, const struct grey_image *image,
		      struct corners *corners);

/* For a camera that never sees the board: are there tags in the mirrored picture? Then the camera
 * mirrors. Returns 0 or -ENOMEM. */
int corner_finder_is_mirrored(struct corner_finder *finder, const struct grey_image *image,
			      bool *mirrored);
