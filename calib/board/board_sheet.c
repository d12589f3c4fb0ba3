/*
 * The board's page, drawn by cairo in metres.
 */
#include "calib/board/board_sheet.h"

#include <math.h>
#include <stdio.h>

#define MARGIN_M 0.015 /* white around the squares; it is part of the board */
#define RULER_M 0.012  /* strips above and left, for the rulers */
#define FOOT_M 0.022   /* below, for the text */
#define TEXT_M 0.0035  /* height of letters */
#define HAIRLINE_M 0.0002

struct board_sheet board_sheet_of(const struct board *board)
{
	double left = MARGIN_M + RULER_M, top = MARGIN_M + RULER_M;

	return (struct board_sheet){.board = board,
				    .left_m = left,
				    .top_m = top,
				    .width_m = left + board->squares_x * board->square_m + MARGIN_M,
				    .height_m = top + board->squares_y * board->square_m +
						MARGIN_M + FOOT_M};
}

static void fill_square(cairo_t *cairo, double x, double y, double edge)
{
	cairo_rectangle(cairo, x, y, edge, edge);
}

static void draw_tag(cairo_t *cairo, const struct board_sheet *sheet,
		     const struct board_pattern *pattern, int index)
{
	double corner_m[2], edge_m;

	board_tag_place(sheet->board, index, corner_m, &edge_m);
	double cell = edge_m / BOARD_TAG_CELLS;
	/* places on the board count from the first inner corner */
	double x0 = sheet->left_m + sheet->board->square_m + corner_m[0] - cell;
	double y0 = sheet->top_m + sheet->board->square_m + corner_m[1] - cell;
	for (int y = 0; y < BOARD_TAG_CELLS_ALL; y++)
		for (int x = 0; x < BOARD_TAG_CELLS_ALL; x++)
			if (pattern->cells[index][y][x])
				fill_square(cairo, x0 + x * cell, y0 + y * cell, cell);
}

static void draw_board(cairo_t *cairo, const struct board_sheet *sheet,
		       const struct board_pattern *pattern)
{
	const struct board *board = sheet->board;

	for (int row = 0; row < board->squares_y; row++)
		for (int column = 0; column < board->squares_x; column++)
			if (board_square_is_black(column, row))
				fill_square(cairo, sheet->left_m + column * board->square_m,
					    sheet->top_m + row * board->square_m, board->square_m);
	for (int i = 0; i < board_tag_count(board); i++)
		draw_tag(cairo, sheet, pattern, i);
	/* all at once: cells that touch leave no seam */
	cairo_set_antialias(cairo, CAIRO_ANTIALIAS_NONE);
	cairo_fill(cairo);
}

static void write_text(cairo_t *cairo, double x, double y, const char *text)
{
	cairo_move_to(cairo, x, y);
	cairo_show_text(cairo, text);
}

/* A ruler of whole centimetres along one edge of the board; `down`: along the left one. */
static void draw_ruler(cairo_t *cairo, const struct board_sheet *sheet, bool down)
{
	const struct board *board = sheet->board;
	double length_m = board->square_m * (down ? board->squares_y : board->squares_x);
	int steps = (int)floor(length_m * 100 + 1e-9);

	cairo_save(cairo);
	if (down) { /* the same drawing, mirrored about the diagonal */
		cairo_matrix_t swap;

		cairo_matrix_init(&swap, 0, 1, 1, 0, 0, 0);
		cairo_transform(cairo, &swap);
	}
	double along = down ? sheet->top_m : sheet->left_m, base = MARGIN_M * 0.6;
	cairo_move_to(cairo, along, base);
	cairo_line_to(cairo, along + steps * 0.01, base);
	for (int i = 0; i <= steps; i++) {
		cairo_move_to(cairo, along + i * 0.01, base);
		cairo_line_to(cairo, along + i * 0.01, base + (i % 10 ? 0.002 : 0.005));
	}
	cairo_stroke(cairo);
	cairo_restore(cairo);
	char text[64];
	snprintf(text, sizeof(text), "%d mm", steps * 10);
	if (down)
		write_text(cairo, MARGIN_M * 0.2, sheet->top_m + steps * 0.01 + 2 * TEXT_M, text);
	else
		write_text(cairo, sheet->left_m + steps * 0.01 - 4 * TEXT_M, base - 0.001, text);
}

static void draw_words(cairo_t *cairo, const struct board_sheet *sheet)
{
	const struct board *board = sheet->board;
	double y = sheet->height_m - FOOT_M;
	char line[200];

	snprintf(line, sizeof(line),
		 "%d x %d squares of %.2f mm, %s %d to %d, tags %.4g of a square", board->squares_x,
		 board->squares_y, 1e3 * board->square_m, BOARD_TAG_FAMILY, board->first_id,
		 board->first_id + board_tag_count(board) - 1, board->tag_part);
	write_text(cairo, sheet->left_m, y + TEXT_M, line);
	write_text(
		cairo, sheet->left_m, y + 2.5 * TEXT_M,
		"Print at 100 %, not \"fit to page\". Measure both rulers: where they are wrong, "
		"print again,");
	write_text(cairo, sheet->left_m, y + 4 * TEXT_M,
		   "or give the squares' true size. Glue it flat on a stiff plate, without gloss.");
	write_text(cairo, sheet->left_m, y + 5.5 * TEXT_M,
		   "Black must be carbon black (laser toner, pigment black): many inks are clear "
		   "in infrared.");
}

void board_sheet_draw(cairo_t *cairo, const struct board_sheet *sheet,
		      const struct board_pattern *pattern)
{
	cairo_set_source_rgb(cairo, 1, 1, 1);
	cairo_paint(cairo);
	cairo_set_source_rgb(cairo, 0, 0, 0);
	cairo_set_line_width(cairo, HAIRLINE_M);
	cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
			       CAIRO_FONT_WEIGHT_NORMAL);
	cairo_set_font_size(cairo, TEXT_M);
	draw_ruler(cairo, sheet, false);
	draw_ruler(cairo, sheet, true);
	draw_words(cairo, sheet);
	draw_board(cairo, sheet, pattern);
}
