/*
 * Images of the cameras: corners as dots, and residuals as arrows, the mean of each part.
 */
#include <math.h>
#include <string.h>

#include "calib/report/report_parts.h"

#define WIDTH 300.0 /* of a drawing */
#define COLUMNS 10
#define ROWS 8
#define RULER 20.0
#define CELL_MIN 3      /* corners of an arrow */
#define ARROW_MOST 18.0 /* of a drawing: the longest arrow of all */

struct field {
	double x, y, dx, dy;
	int count;
};

static void print_frame(FILE *file, const struct observed_camera *camera)
{
	double height = WIDTH * camera->height_px / camera->width_px;

	fprintf(file,
		"<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" class=\"image\">\n"
		"<rect width=\"%.0f\" height=\"%.0f\" class=\"frame\"/>\n",
		WIDTH, height, WIDTH, height, WIDTH, height);
}

static void print_dots(FILE *file, const struct report_facts *facts, uint32_t c)
{
	const struct observations *o = facts->rig->observations;
	double scale = WIDTH / o->cameras[c].width_px;

	print_frame(file, &o->cameras[c]);
	fprintf(file, "<path class=\"dots\" d=\"");
	for (uint32_t v = 0; v < o->view_count; v++) {
		const double(*px)[2] = observations_px(o, v);

		for (uint32_t i = 0; i < o->corner_count && o->views[v].camera == c; i++)
			if (!isnan(px[i][0]))
				fprintf(file, "M%.1f %.1fh0", (px[i][0] + 0.5) * scale,
					(px[i][1] + 0.5) * scale);
	}
	fprintf(file, "\"/>\n</svg>\n");
}

static void add_residuals(struct field fields[ROWS][COLUMNS], const struct report_facts *facts,
			  uint32_t c)
{
	const struct observations *o = facts->rig->observations;
	const struct solution *s = facts->rig->solution;

	for (uint32_t v = 0; v < o->view_count; v++) {
		const double(*px)[2] = observations_px(o, v);

		for (uint32_t i = 0; i < o->corner_count && o->views[v].camera == c; i++) {
			const double *left = s->residual_px[(size_t)v * s->corner_count + i];

			if (isnan(left[0]))
				continue;
			int x = (int)((px[i][0] + 0.5) / o->cameras[c].width_px * COLUMNS);
			int y = (int)((px[i][1] + 0.5) / o->cameras[c].height_px * ROWS);
			struct field *f =
				&fields[y < ROWS ? y : ROWS - 1][x < COLUMNS ? x : COLUMNS - 1];
			f->x += px[i][0];
			f->y += px[i][1];
			f->dx += left[0];
			f->dy += left[1];
			f->count++;
		}
	}
}

/* Pixels to a drawing, so that the longest arrow of all cameras is seen: 1, 2 or 5 of a power of
 * ten. */
static double arrow_scale(const struct report_facts *facts)
{
	double longest_px = 1e-4;

	for (uint32_t c = 0; c < facts->rig->observations->camera_count; c++) {
		struct field fields[ROWS][COLUMNS];

		memset(fields, 0, sizeof(fields));
		add_residuals(fields, facts, c);
		for (int i = 0; i < ROWS * COLUMNS; i++) {
			const struct field *f = &fields[i / COLUMNS][i % COLUMNS];

			if (f->count >= CELL_MIN)
				longest_px = fmax(longest_px, hypot(f->dx, f->dy) / f->count);
		}
	}
	double most = ARROW_MOST / longest_px, ten = pow(10, floor(log10(most)));
	return most >= 5 * ten ? 5 * ten : most >= 2 * ten ? 2 * ten : ten;
}

static void print_arrow(FILE *file, const struct field *f, double scale, double arrow)
{
	double x = f->x / f->count * scale, y = f->y / f->count * scale;
	double dx = f->dx / f->count * arrow, dy = f->dy / f->count * arrow;

	fprintf(file,
		"<circle cx=\"%.1f\" cy=\"%.1f\" r=\"1.6\"/><path d=\"M%.1f %.1fl%.1f %.1f\"/>\n",
		x, y, x, y, dx, dy);
}

static void print_field(FILE *file, const struct report_facts *facts, uint32_t c, double arrow)
{
	const struct observed_camera *camera = &facts->rig->observations->cameras[c];
	struct field fields[ROWS][COLUMNS];

	memset(fields, 0, sizeof(fields));
	add_residuals(fields, facts, c);
	print_frame(file, camera);
	fprintf(file, "<g class=\"arrows\">\n");
	for (int y = 0; y < ROWS; y++)
		for (int x = 0; x < COLUMNS; x++)
			if (fields[y][x].count >= CELL_MIN)
				print_arrow(file, &fields[y][x], WIDTH / camera->width_px, arrow);
	fprintf(file,
		"</g>\n<path class=\"ruler\" d=\"M8 12h%.0f\"/><text x=\"%.0f\" y=\"16\">%g px"
		"</text>\n</svg>\n",
		RULER, RULER + 14, RULER / arrow);
}

void report_images_print(FILE *file, const struct report_facts *facts)
{
	const struct observations *o = facts->rig->observations;
	double arrow = arrow_scale(facts);
	char words[COVERAGE_WORDS_BYTES];

	fprintf(file,
		"<h2>Images</h2>\n<p>Left: every corner that was seen; gaps are where the lens "
		"is only guessed. Right: what the solve leaves, the mean of each part of the "
		"image, enlarged. Short arrows without a pattern are noise; a pattern "
		"is something that the lens model cannot describe.</p>\n<div class=\"grid\">\n");
	for (uint32_t c = 0; c < o->camera_count; c++) {
		coverage_missing(&facts->coverage[c], o->camera_count == 1, words);
		fprintf(file, "<figure><figcaption><b>%s</b> %s%s</figcaption>\n",
			o->cameras[c].name, *words ? "could do with: " : "covered", words);
		print_dots(file, facts, c);
		print_field(file, facts, c, arrow);
		fprintf(file, "</figure>\n");
	}
	fprintf(file, "</div>\n");
}
