/*
 * The page with the board on it: the checkerboard with its tags, two rulers, a few words. Only
 * calib/ and its tests include this.
 */
#pragma once

#include <cairo.h>
#include <stdbool.h>

#include "config/board_pattern.h"

struct board_sheet {
	const struct board *board; /* borrowed */
	double left_m, top_m;      /* of the first square */
	double width_m, height_m;  /* of the page */
};

struct board_sheet board_sheet_of(const struct board *board);

/* Draws the page; `cairo` is scaled so that its unit is a metre. */
void board_sheet_draw(cairo_t *cairo, const struct board_sheet *sheet,
		      const struct board_pattern *pattern);
