/*
 * The board as a PDF, true to scale: the checkerboard with its tags, two rulers to check the print
 * by, and what to mind. One page, as large as the board needs.
 */
#pragma once

#include "base/diag.h"
#include "config/board.h"

/* Writes to `path`, whole or not at all. Returns 0, -EINVAL for a board that is refused or larger
 * than a page of PDF may be, or a negative errno of writing; each with a message. */
int board_pdf_write(const char *path, const struct board *board, struct diag *diag);

/* The square's edge for tags of at least BOARD_CELL_MIN_PX pixels a cell at that range: the choice
 * of a board for a camera. */
#define BOARD_CELL_MIN_PX 2.5
double board_square_for(double range_m, double focal_px, double tag_part);
