/*
 * What is printed on a board, black or white at every place: for printing it, for rendering it, and
 * for those who want to know what a tag looks like.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "config/board.h"

#define BOARD_TAG_CELLS_ALL (BOARD_TAG_CELLS + 2) /* with the white rim */
#define BOARD_PATTERN_TAGS ((BOARD_SQUARES_MAX * BOARD_SQUARES_MAX + 1) / 2)

struct board_pattern {
	struct board board;
	uint8_t cells[BOARD_PATTERN_TAGS][BOARD_TAG_CELLS_ALL][BOARD_TAG_CELLS_ALL]; /* 1: black */
};

/* `board` has passed board_check(). Returns 0 or -ENOMEM. */
int board_pattern_init(struct board_pattern *pattern, const struct board *board);

/* The place of tag `index` on the print: its black border's upper left corner and its edge. */
void board_tag_place(const struct board *board, int index, double corner_m[2], double *edge_m);

/* Whether the print is black at (x, y) of the board's frame; white outside the board. Any thread.
 */
bool board_is_black(const struct board_pattern *pattern, double x_m, double y_m);
