/*
 * The calibration board: a checkerboard with AprilTags in its white squares. Its frame: origin at
 * the first inner corner, x to the right and y down along the print as one looks at it, z into the
 * board; metres. A camera that faces the board upright has parallel axes.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "base/geometry.h"

#define BOARD_SQUARES_MIN 4
#define BOARD_SQUARES_MAX 24
#define BOARD_CORNER_MAX ((BOARD_SQUARES_MAX - 1) * (BOARD_SQUARES_MAX - 1))
#define BOARD_TAG_FAMILY "tag36h11" /* the one family: 16h5 sees tags where there are none */
#define BOARD_TAG_COUNT 587         /* identities of the family */
#define BOARD_TAG_CELLS 8           /* across the black border of a tag */

struct board {
	int squares_x, squares_y; /* all squares, the border's included */
	double square_m;          /* edge of a square, as printed */
	double tag_part;          /* edge of a tag's black border over that of a square */
	int first_id;             /* of the first tag; they count on along the rows */
	/* How far the middle of a row and of a column stands behind its ends, a parabola each
	 * (mrcal's calobject_warp). */
	double warp_x_m, warp_y_m;
};

/* 11 x 8 squares of 60 mm, tags 0.7 of a square from identity 0 on, flat. */
#define BOARD_DEFAULT \
	((struct board){.squares_x = 11, .squares_y = 8, .square_m = 0.06, .tag_part = 0.7})

/* Every number that is out of its range is one message; `name` is of the file or the option.
 * Returns 0 or -EINVAL. */
int board_check(const struct board *board, const char *name, struct diag *diag);

static inline int board_corners_x(const struct board *board)
{
	return board->squares_x - 1;
}

static inline int board_corners_y(const struct board *board)
{
	return board->squares_y - 1;
}

/* Inner corners; corner i is in column i % corners_x and row i / corners_x. */
static inline int board_corner_count(const struct board *board)
{
	return board_corners_x(board) * board_corners_y(board);
}

/* Square (column, row); the first one is black. */
static inline bool board_square_is_black(int column, int row)
{
	return (column + row) % 2 == 0;
}

static inline int board_tag_count(const struct board *board)
{
	return board->squares_x * board->squares_y / 2;
}

/* The square that tag `index` (identity less first_id) stands in. */
static inline void board_tag_square(const struct board *board, int index, int *column, int *row)
{
	int two_rows = board->squares_x; /* white squares in two rows */
	int in_even = board->squares_x / 2;
	int rest = index % two_rows;
	bool odd = rest >= in_even;

	*row = index / two_rows * 2 + odd;
	*column = odd ? (rest - in_even) * 2 : rest * 2 + 1;
}

/* The tag in a white square. */
static inline int board_tag_in_square(const struct board *board, int column, int row)
{
	int before = row / 2 * board->squares_x;

	return row % 2 ? before + board->squares_x / 2 + column / 2 : before + column / 2;
}

/* Of the surface at (x, y) on the print, warp included. */
static inline struct vec3 board_point_m(const struct board *board, double x_m, double y_m)
{
	double u = x_m / (board->square_m * (board_corners_x(board) - 1));
	double v = y_m / (board->square_m * (board_corners_y(board) - 1));

	return (struct vec3){x_m, y_m,
			     4 * board->warp_x_m * u * (1 - u) + 4 * board->warp_y_m * v * (1 - v)};
}

static inline struct vec3 board_corner_m(const struct board *board, int corner)
{
	return board_point_m(board, board->square_m * (corner % board_corners_x(board)),
			     board->square_m * (corner / board_corners_x(board)));
}
