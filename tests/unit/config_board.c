/*
 * The board's description and what is printed on it.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "config/board_pattern.h"

static void every_white_square_has_one_tag(void **state)
{
	(void)state;
	const int sizes[][2] = {{11, 8}, {8, 11}, {9, 9}, {4, 5}, {24, 24}};

	for (size_t s = 0; s < 5; s++) {
		struct board board = BOARD_DEFAULT;
		bool seen[BOARD_SQUARES_MAX][BOARD_SQUARES_MAX] = {{false}};

		board.squares_x = sizes[s][0];
		board.squares_y = sizes[s][1];
		for (int i = 0; i < board_tag_count(&board); i++) {
			int column, row;

			board_tag_square(&board, i, &column, &row);
			assert_in_range(column, 0, board.squares_x - 1);
			assert_in_range(row, 0, board.squares_y - 1);
			assert_false(board_square_is_black(column, row));
			assert_false(seen[row][column]);
			seen[row][column] = true;
		}
	}
}

static void tags_are_printed_where_their_place_says(void **state)
{
	(void)state;
	static struct board_pattern pattern;
	struct board board = BOARD_DEFAULT;

	board.squares_x = 9;
	board.squares_y = 7;
	assert_int_equal(board_pattern_init(&pattern, &board), 0);
	for (int i = 0; i < board_tag_count(&board); i++) {
		double corner_m[2], edge_m;

		board_tag_place(&board, i, corner_m, &edge_m);
		double cell_m = edge_m / BOARD_TAG_CELLS;
		for (int y = 0; y < BOARD_TAG_CELLS_ALL; y++)
			for (int x = 0; x < BOARD_TAG_CELLS_ALL; x++)
				assert_int_equal(board_is_black(&pattern,
								corner_m[0] + (x - 0.5) * cell_m,
								corner_m[1] + (y - 0.5) * cell_m),
						 pattern.cells[i][y][x]);
		for (int x = 0; x < BOARD_TAG_CELLS_ALL; x++) /* the white rim, the black border */
			assert_int_equal(pattern.cells[i][0][x], 0);
		for (int x = 1; x <= BOARD_TAG_CELLS; x++)
			assert_int_equal(pattern.cells[i][1][x], 1);
	}
}

static void squares_alternate_around_an_inner_corner(void **state)
{
	(void)state;
	static struct board_pattern pattern;
	struct board board = BOARD_DEFAULT;
	double e = board.square_m * 0.01;

	assert_int_equal(board_pattern_init(&pattern, &board), 0);
	for (int i = 0; i < board_corner_count(&board); i++) {
		struct vec3 p = board_corner_m(&board, i);
		bool first = board_is_black(&pattern, p.x - e, p.y - e);

		assert_int_equal(board_is_black(&pattern, p.x + e, p.y + e), first);
		assert_int_equal(board_is_black(&pattern, p.x + e, p.y - e), !first);
		assert_int_equal(board_is_black(&pattern, p.x - e, p.y + e), !first);
	}
	assert_true(board_is_black(&pattern, -e, -e)); /* of the first corner, the first square */
}

static void warp_bends_the_middle_and_not_the_ends(void **state)
{
	(void)state;
	struct board board = BOARD_DEFAULT;

	board.warp_x_m = 0.002;
	double width_m = board.square_m * (board_corners_x(&board) - 1);
	assert_float_equal(board_point_m(&board, 0, 0.1).z, 0, 1e-15);
	assert_float_equal(board_point_m(&board, width_m, 0.1).z, 0, 1e-15);
	assert_float_equal(board_point_m(&board, width_m / 2, 0.1).z, 0.002, 1e-15);
}

static void every_bad_number_is_named(void **state)
{
	(void)state;
	struct board board = {.squares_x = 3, .squares_y = 99, .square_m = NAN, .tag_part = 0.9};
	struct diag diag = {0};

	assert_int_equal(board_check(&board, "board", &diag), -EINVAL);
	assert_int_equal(diag.count, 4);
	diag_finish(&diag);
	board = BOARD_DEFAULT;
	assert_int_equal(board_check(&board, "board", &diag), 0);
	board.first_id = 544;
	assert_int_equal(board_check(&board, "board", &diag), -EINVAL);
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_white_square_has_one_tag),
		cmocka_unit_test(tags_are_printed_where_their_place_says),
		cmocka_unit_test(squares_alternate_around_an_inner_corner),
		cmocka_unit_test(warp_bends_the_middle_and_not_the_ends),
		cmocka_unit_test(every_bad_number_is_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
