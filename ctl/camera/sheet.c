/*
 * Lays out the sheet: a title, the tiles in rows, a legend.
 */
#include "ctl/camera/sheet.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/output_file.h"
#include "ctl/camera/sheet_parts.h"

#define TILE_WIDTH 720
#define TILE_HEIGHT 576
#define GAP 12
#define TITLE_HEIGHT 40
#define CAPTION_HEIGHT 24
#define LEGEND_HEIGHT 34
#define LEGEND_SPACE 26
#define COLUMNS_MAX 4

static const struct {
	enum sheet_mark_kind kind;
	const char *text;
} SYMBOLS[] = {
	{SHEET_SPOT, "spot found"},
	{SHEET_CROSS, "marker or corner"},
	{SHEET_MISSED, "marker without a spot"},
	{SHEET_STRAY, "spot of no marker"},
};

struct sheet_mark *sheet_add_mark(struct sheet_tile *tile, enum sheet_mark_kind kind, double x_px,
				  double y_px)
{
	static struct sheet_mark beyond; /* written, never read */

	if (tile->mark_count == SHEET_MARK_MAX)
		return &beyond;
	struct sheet_mark *mark = &tile->marks[tile->mark_count++];

	*mark = (struct sheet_mark){.kind = kind, .x_px = x_px, .y_px = y_px, .group = -1};
	return mark;
}

int sheet_group(const struct layout *layout, uint32_t marker)
{
	int group = 0;

	for (uint32_t m = 0; m < layout->marker_count; m++) {
		bool first = true;

		for (uint32_t before = 0; before < m && first; before++)
			first = strcmp(layout->markers[before].group, layout->markers[m].group) !=
				0;
		if (strcmp(layout->markers[m].group, layout->markers[marker].group) == 0)
			return group;
		group += first;
	}
	return -1;
}

uint32_t sheet_layout_legend(const struct layout *layout, struct sheet_legend *out, uint32_t max)
{
	uint32_t count = 0;

	for (uint32_t m = 0; m < layout->marker_count && count < max; m++)
		if (sheet_group(layout, m) == (int)count) {
			const char *name = layout->markers[m].group;

			out[count] = (struct sheet_legend){(int)count, name[0] ? name : "others"};
			count++;
		}
	return count;
}

static int column_count(uint32_t tile_count)
{
	int columns = (int)ceil(sqrt(tile_count));

	return columns > COLUMNS_MAX ? COLUMNS_MAX : columns < 1 ? 1 : columns;
}

static void write_text(cairo_t *cr, double x, double y, double size, const char *text)
{
	cairo_set_font_size(cr, size);
	cairo_move_to(cr, x, y);
	cairo_show_text(cr, text);
}

static int draw_tile(cairo_t *cr, const struct sheet *sheet, uint32_t index, double left,
		     double top)
{
	const struct sheet_tile *tile = &sheet->tiles[index];
	struct sheet_frame frame = {
		.left = left, .top = top, .width = TILE_WIDTH, .height = TILE_HEIGHT};

	sheet_frame_choose(&frame, tile, sheet->whole);
	int err = sheet_paint_picture(cr, &frame, tile->snapshot);

	if (err)
		return err;
	sheet_draw_marks(cr, &frame, tile);
	cairo_set_source_rgb(cr, 0.88, 0.88, 0.88);
	write_text(cr, left, top + TILE_HEIGHT + 17, 14, tile->caption);
	return 0;
}

static double legend_text(cairo_t *cr, double x, double y, const char *text)
{
	cairo_text_extents_t size;

	cairo_set_font_size(cr, 13);
	cairo_text_extents(cr, text, &size);
	write_text(cr, x, y, 13, text);
	return x + size.x_advance + LEGEND_SPACE;
}

static void draw_legend(cairo_t *cr, const struct sheet *sheet, double y)
{
	double x = GAP;

	for (size_t i = 0; i < sizeof(SYMBOLS) / sizeof(SYMBOLS[0]); i++) {
		struct sheet_mark mark = {.kind = SYMBOLS[i].kind, .group = -1};
		struct colour colour = sheet_colour(&mark);

		cairo_set_source_rgb(cr, colour.red, colour.green, colour.blue);
		sheet_draw_symbol(cr, mark.kind, x + 7, y - 5, 6, 1);
		x = legend_text(cr, x + 20, y, SYMBOLS[i].text);
	}
	for (uint32_t i = 0; i < sheet->legend_count; i++) {
		struct colour colour = sheet_group_colour(sheet->legend[i].group);

		cairo_set_source_rgb(cr, colour.red, colour.green, colour.blue);
		cairo_rectangle(cr, x, y - 10, 10, 10);
		cairo_fill(cr);
		x = legend_text(cr, x + 15, y, sheet->legend[i].name);
	}
}

static int draw(cairo_t *cr, const struct sheet *sheet, int columns, double height)
{
	int err = 0;

	cairo_set_source_rgb(cr, 0.13, 0.13, 0.14);
	cairo_paint(cr);
	cairo_select_font_face(cr, "sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
	cairo_set_source_rgb(cr, 1, 1, 1);
	write_text(cr, GAP, 27, 18, sheet->title);
	for (uint32_t i = 0; !err && i < sheet->tile_count; i++)
		err = draw_tile(cr, sheet, i, GAP + (int)i % columns * (TILE_WIDTH + GAP),
				TITLE_HEIGHT +
					(int)i / columns * (TILE_HEIGHT + CAPTION_HEIGHT + GAP));
	draw_legend(cr, sheet, height - 12);
	return err;
}

static int errno_of_cairo(cairo_status_t status)
{
	if (status == CAIRO_STATUS_SUCCESS)
		return 0;
	if (status == CAIRO_STATUS_WRITE_ERROR)
		return errno ? -errno : -EIO;
	return -ENOMEM;
}

/* A smaller copy; the surface itself is given up. */
static cairo_surface_t *made_smaller(cairo_surface_t *surface, int width_px)
{
	int width = cairo_image_surface_get_width(surface);
	double scale = (double)width_px / width;
	int height_px = (int)ceil(scale * cairo_image_surface_get_height(surface));

	if (width_px <= 0 || width_px >= width)
		return surface;
	cairo_surface_t *small =
		cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px);
	cairo_t *cr = cairo_create(small);

	cairo_scale(cr, scale, scale);
	cairo_set_source_surface(cr, surface, 0, 0);
	cairo_pattern_set_filter(cairo_get_source(cr), CAIRO_FILTER_GOOD);
	cairo_paint(cr);
	cairo_destroy(cr);
	cairo_surface_destroy(surface);
	return small;
}

static cairo_status_t put(void *file, const unsigned char *bytes, unsigned size)
{
	return fwrite(bytes, 1, size, file) == size ? CAIRO_STATUS_SUCCESS
						    : CAIRO_STATUS_WRITE_ERROR;
}

static int write_surface(cairo_surface_t *surface, const char *path)
{
	struct output_file file;
	int err = output_file_open(&file, path, NULL);

	if (err)
		return err;
	errno = 0;
	err = errno_of_cairo(cairo_surface_write_to_png_stream(surface, put, file.stream));
	return output_file_end(&file, err, NULL);
}

int sheet_write_png(const struct sheet *sheet, const char *path)
{
	int columns = column_count(sheet->tile_count);
	int rows = ((int)sheet->tile_count + columns - 1) / columns;
	int width = GAP + columns * (TILE_WIDTH + GAP);
	int height = TITLE_HEIGHT + rows * (TILE_HEIGHT + CAPTION_HEIGHT + GAP) + LEGEND_HEIGHT;
	cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
	cairo_t *cr = cairo_create(surface);
	int err = errno_of_cairo(cairo_status(cr));

	if (!err)
		err = draw(cr, sheet, columns, height);
	if (!err)
		err = errno_of_cairo(cairo_status(cr));
	cairo_destroy(cr);
	surface = made_smaller(surface, sheet->width_px);
	if (!err)
		err = write_surface(surface, path);
	cairo_surface_destroy(surface);
	return err;
}
