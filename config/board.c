/*
 * What makes a board description fit for use.
 */
#include "config/board.h"

#include <errno.h>
#include <math.h>

#define TAG_PART_MIN 0.4
#define TAG_PART_MAX 0.78 /* its white rim, a cell wide, must fit into the square */

static bool range_check(const char *name, const char *field, double value, double low, double high,
			struct diag *diag)
{
	if (value >= low && value <= high)
		return true;
	diag_add(diag, "%s: %s: %g is outside %g to %g", name, field, value, low, high);
	return false;
}

int board_check(const struct board *board, const char *name, struct diag *diag)
{
	bool good = true;

	good &= range_check(name, "squares_x", board->squares_x, BOARD_SQUARES_MIN,
			    BOARD_SQUARES_MAX, diag);
	good &= range_check(name, "squares_y", board->squares_y, BOARD_SQUARES_MIN,
			    BOARD_SQUARES_MAX, diag);
	good &= range_check(name, "square_m", board->square_m, 0.001, 1, diag);
	good &= range_check(name, "tag_part", board->tag_part, TAG_PART_MIN, TAG_PART_MAX, diag);
	good &= range_check(name, "warp_x_m", board->warp_x_m, -0.05, 0.05, diag);
	good &= range_check(name, "warp_y_m", board->warp_y_m, -0.05, 0.05, diag);
	if (!good)
		return -EINVAL;
	if (range_check(name, "first_id", board->first_id, 0,
			BOARD_TAG_COUNT - board_tag_count(board), diag))
		return 0;
	return -EINVAL;
}
