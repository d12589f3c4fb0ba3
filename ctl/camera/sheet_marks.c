/*
 * Rings, crosses and names. Each name goes to the nearest place around its mark that no other name
 * and no mark has yet; one that has none is left out.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ctl/camera/sheet_parts.h"

#define LABEL_FONT 10.5
#define RING_GAP 3.0 /* between a spot's edge and its ring, on paper */
#define CROSS_ARM 4.0
#define SIZE_MIN 0.4   /* of symbols, where pictures are made small */
#define MARK_REACH 3.0 /* of a cross, for names that keep away */
#define DIRECTIONS 16

static const double REACHES[] = {7, 13, 20, 28, 38};

static const struct colour PALETTE[SHEET_GROUPS] = {
	{0.35, 0.80, 1.00}, {1.00, 0.72, 0.25}, {0.55, 0.95, 0.45}, {1.00, 0.55, 0.80},
	{0.75, 0.65, 1.00}, {0.95, 0.95, 0.40}, {0.35, 0.95, 0.80}, {1.00, 0.62, 0.52},
	{0.65, 0.80, 0.65}, {0.90, 0.78, 0.95}, {0.80, 0.90, 1.00}, {0.85, 0.80, 0.60},
};

struct box {
	double x0, y0, x1, y1;
};

struct layout_of_names {
	const struct sheet_frame *frame;
	const struct sheet_tile *tile;
	uint32_t count;
	struct box taken[SHEET_MARK_MAX];
};

struct colour sheet_group_colour(int group)
{
	return group < 0 ? (struct colour){0.85, 0.85, 0.85} : PALETTE[group % SHEET_GROUPS];
}

struct colour sheet_colour(const struct sheet_mark *mark)
{
	if (mark->kind == SHEET_STRAY)
		return (struct colour){1.0, 0.3, 0.25};
	return sheet_group_colour(mark->group);
}

static void to_paper(const struct sheet_frame *frame, const struct sheet_mark *mark, double at[2])
{
	/* half a pixel: pixel (0,0) is the middle of the top-left one */
	at[0] = frame->left + (mark->x_px + 0.5 - frame->origin_px[0]) * frame->scale;
	at[1] = frame->top + (mark->y_px + 0.5 - frame->origin_px[1]) * frame->scale;
}

static void stroke_cross(cairo_t *cr, double x, double y, double size)
{
	double arm = CROSS_ARM * size;

	cairo_move_to(cr, x - arm, y);
	cairo_line_to(cr, x + arm, y);
	cairo_move_to(cr, x, y - arm);
	cairo_line_to(cr, x, y + arm);
	cairo_stroke(cr);
}

void sheet_draw_symbol(cairo_t *cr, enum sheet_mark_kind kind, double x, double y, double radius,
		       double size)
{
	static const double dashes[] = {3, 2.5};

	cairo_set_line_width(cr, size * (kind == SHEET_STRAY ? 1.6 : 1.1));
	if (kind == SHEET_CROSS || kind == SHEET_MISSED)
		stroke_cross(cr, x, y, size);
	if (kind == SHEET_CROSS)
		return;
	if (kind == SHEET_MISSED)
		cairo_set_dash(cr, dashes, 2, 0);
	cairo_new_sub_path(cr);
	cairo_arc(cr, x, y, radius, 0, 2 * M_PI);
	cairo_stroke(cr);
	cairo_set_dash(cr, NULL, 0, 0);
}

static bool is_on_paper(const struct sheet_frame *frame, const double at[2])
{
	return at[0] >= frame->left && at[1] >= frame->top && at[0] <= frame->left + frame->width &&
	       at[1] <= frame->top + frame->height;
}

static void draw_symbols(cairo_t *cr, const struct sheet_frame *frame,
			 const struct sheet_tile *tile)
{
	double size = fmin(fmax(frame->scale, SIZE_MIN), 1);

	for (uint32_t i = 0; i < tile->mark_count; i++) {
		const struct sheet_mark *mark = &tile->marks[i];
		struct colour colour = sheet_colour(mark);
		double at[2];

		to_paper(frame, mark, at);
		cairo_set_source_rgb(cr, colour.red, colour.green, colour.blue);
		sheet_draw_symbol(cr, mark->kind, at[0], at[1],
				  mark->radius_px * frame->scale + RING_GAP * size, size);
	}
}

static bool boxes_meet(const struct box *a, const struct box *b)
{
	return a->x0 < b->x1 && b->x0 < a->x1 && a->y0 < b->y1 && b->y0 < a->y1;
}

static bool is_free(const struct layout_of_names *names, const struct box *box)
{
	const struct sheet_frame *frame = names->frame;

	if (box->x0 < frame->left || box->y0 < frame->top || box->x1 > frame->left + frame->width ||
	    box->y1 > frame->top + frame->height)
		return false;
	for (uint32_t i = 0; i < names->count; i++)
		if (boxes_meet(box, &names->taken[i]))
			return false;
	for (uint32_t i = 0; i < names->tile->mark_count; i++) {
		double at[2];

		to_paper(frame, &names->tile->marks[i], at);
		const struct box mark = {at[0] - MARK_REACH, at[1] - MARK_REACH, at[0] + MARK_REACH,
					 at[1] + MARK_REACH};

		if (boxes_meet(box, &mark))
			return false;
	}
	return true;
}

/* The first free place for a name of that size around `at`. */
static bool find_place(const struct layout_of_names *names, const double at[2], double width,
		       double height, struct box *box)
{
	for (size_t r = 0; r < sizeof(REACHES) / sizeof(REACHES[0]); r++)
		for (int d = 0; d < DIRECTIONS; d++) {
			double angle = 2 * M_PI * d / DIRECTIONS;
			double x = at[0] + REACHES[r] * cos(angle);
			double y = at[1] + REACHES[r] * sin(angle) - 0.5 * height;

			x -= width * (0.5 - 0.5 * cos(angle)); /* beside, or above and below */
			y += 0.5 * height * sin(angle);
			*box = (struct box){x, y, x + width, y + height};
			if (is_free(names, box))
				return true;
		}
	return false;
}

/* From the mark to the near side of its name, when that is away. */
static void draw_leader(cairo_t *cr, const double at[2], const struct box *box)
{
	double x = fmin(fmax(at[0], box->x0), box->x1), y = fmin(fmax(at[1], box->y0), box->y1);

	if (hypot(x - at[0], y - at[1]) < REACHES[0] + 1)
		return;
	cairo_set_line_width(cr, 0.6);
	cairo_move_to(cr, at[0], at[1]);
	cairo_line_to(cr, x, y);
	cairo_stroke(cr);
}

static void draw_name(cairo_t *cr, struct layout_of_names *names, const struct sheet_mark *mark)
{
	struct colour colour = sheet_colour(mark);
	cairo_text_extents_t size;
	struct box box;
	double at[2];

	to_paper(names->frame, mark, at);
	cairo_text_extents(cr, mark->label, &size);
	if (!is_on_paper(names->frame, at) ||
	    !find_place(names, at, size.x_advance + 2, LABEL_FONT + 1, &box))
		return;
	names->taken[names->count++] = box;
	cairo_set_source_rgba(cr, 0, 0, 0, 0.55);
	cairo_rectangle(cr, box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0);
	cairo_fill(cr);
	cairo_set_source_rgb(cr, colour.red, colour.green, colour.blue);
	cairo_move_to(cr, box.x0 + 1, box.y1 - 2.5);
	cairo_show_text(cr, mark->label);
	draw_leader(cr, at, &box);
}

void sheet_draw_marks(cairo_t *cr, const struct sheet_frame *frame, const struct sheet_tile *tile)
{
	struct layout_of_names *names = calloc(1, sizeof(*names));

	cairo_save(cr);
	cairo_rectangle(cr, frame->left, frame->top, frame->width, frame->height);
	cairo_clip(cr);
	draw_symbols(cr, frame, tile);
	cairo_set_font_size(cr, LABEL_FONT);
	if (names) {
		names->frame = frame;
		names->tile = tile;
		for (uint32_t i = 0; i < tile->mark_count; i++)
			if (tile->marks[i].label[0])
				draw_name(cr, names, &tile->marks[i]);
	}
	free(names);
	cairo_restore(cr);
}
