/*
 * What the files of the contact sheet share.
 */
#pragma once

#include <cairo.h>

#include "ctl/camera/sheet.h"

#define SHEET_GROUPS 12

struct colour {
	double red, green, blue;
};

/* Where a tile's picture lands: paper = (pixel - origin_px) * scale + (left, top). */
struct sheet_frame {
	double left, top, width, height;
	double origin_px[2], scale;
};

struct colour sheet_colour(const struct sheet_mark *mark);
struct colour sheet_group_colour(int group);

/* Chooses the part of the picture that the tile shows. */
void sheet_frame_choose(struct sheet_frame *frame, const struct sheet_tile *tile, bool whole);

/* Paints the picture, its dark parts lifted. Returns 0 or -ENOMEM. */
int sheet_paint_picture(cairo_t *cr, const struct sheet_frame *frame,
			const struct snapshot *snapshot);

/* Draws marks and names; a name that finds no free place is left out. */
void sheet_draw_marks(cairo_t *cr, const struct sheet_frame *frame, const struct sheet_tile *tile);

/* One symbol of a mark at a place of the paper; `size`: 1 = as it should be. */
void sheet_draw_symbol(cairo_t *cr, enum sheet_mark_kind kind, double x, double y, double radius,
		       double size);
