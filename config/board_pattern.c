/*
 * The printed pattern of a board; tags come from libapriltag.
 */
#include "config/board_pattern.h"

#include <apriltag/apriltag.h>
#include <apriltag/common/image_u8.h>
#include <apriltag/tag36h11.h>
#include <assert.h>
#include <errno.h>
#include <math.h>
#include <string.h>

static int draw_tag(uint8_t cells[BOARD_TAG_CELLS_ALL][BOARD_TAG_CELLS_ALL],
		    apriltag_family_t *family, int id)
{
	image_u8_t *image = apriltag_to_image(family, (uint32_t)id);

	if (!image)
		return -ENOMEM;
	assert(image->width == BOARD_TAG_CELLS_ALL && image->height == BOARD_TAG_CELLS_ALL);
	for (int y = 0; y < BOARD_TAG_CELLS_ALL; y++)
		for (int x = 0; x < BOARD_TAG_CELLS_ALL; x++)
			cells[y][x] = image->buf[y * image->stride + x] < 128;
	image_u8_destroy(image);
	return 0;
}

int board_pattern_init(struct board_pattern *pattern, const struct board *board)
{
	apriltag_family_t *family = tag36h11_create();
	int err = family ? 0 : -ENOMEM;

	memset(pattern, 0, sizeof(*pattern));
	pattern->board = *board;
	for (int i = 0; !err && i < board_tag_count(board); i++)
		err = draw_tag(pattern->cells[i], family, board->first_id + i);
	if (family)
		tag36h11_destroy(family);
	return err;
}

void board_tag_place(const struct board *board, int index, double corner_m[2], double *edge_m)
{
	double rim = (1 - board->tag_part) / 2;
	int column, row;

	board_tag_square(board, index, &column, &row);
	corner_m[0] = (column - 1 + rim) * board->square_m;
	corner_m[1] = (row - 1 + rim) * board->square_m;
	*edge_m = board->tag_part * board->square_m;
}

bool board_is_black(const struct board_pattern *pattern, double x_m, double y_m)
{
	const struct board *board = &pattern->board;
	double u = x_m / board->square_m + 1, v = y_m / board->square_m + 1;
	int column = (int)floor(u), row = (int)floor(v);

	if (column < 0 || column >= board->squares_x || row < 0 || row >= board->squares_y)
		return false;
	if (board_square_is_black(column, row))
		return true;
	double scale = BOARD_TAG_CELLS / board->tag_part;
	int x = (int)floor((u - column - 0.5) * scale + BOARD_TAG_CELLS_ALL / 2.0);
	int y = (int)floor((v - row - 0.5) * scale + BOARD_TAG_CELLS_ALL / 2.0);

	return x >= 0 && x < BOARD_TAG_CELLS_ALL && y >= 0 && y < BOARD_TAG_CELLS_ALL &&
	       pattern->cells[board_tag_in_square(board, column, row)][y][x];
}
