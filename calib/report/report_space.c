/*
 * Three projections along the axes of the stage.
 */
#include <math.h>

#include "calib/board/sight.h"
#include "calib/report/report_parts.h"
#include "calib/rt.h"

#define SIZE 380.0 /* of a drawing, each way */
#define MARGIN 34.0
#define FRUSTUM_PART 0.09 /* of the drawing's width: a camera's length */

/* Which stage axis goes to the right and which one up, and their signs. */
struct look {
	const char *name;
	int right, up;
};

static const struct look LOOKS[] = {{"x and y", 0, 1}, {"x and z", 0, 2}, {"z and y", 2, 1}};
#define LOOK_COUNT (sizeof(LOOKS) / sizeof(*LOOKS))

struct box {
	double low[3], high[3];
};

static double axis_of(struct vec3 p, int axis)
{
	return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

static void box_add(struct box *box, struct vec3 p)
{
	for (int axis = 0; axis < 3; axis++) {
		box->low[axis] = fmin(box->low[axis], axis_of(p, axis));
		box->high[axis] = fmax(box->high[axis], axis_of(p, axis));
	}
}

/* Metres to a drawing. */
struct sheet {
	struct look look;
	double scale, middle[2];
};

static struct sheet sheet_of(const struct box *box, const struct look *look)
{
	double span = 1e-6;

	for (int axis = 0; axis < 3; axis++)
		span = fmax(span, box->high[axis] - box->low[axis]);
	return (struct sheet){*look,
			      (SIZE - 2 * MARGIN) / span,
			      {(box->low[look->right] + box->high[look->right]) / 2,
			       (box->low[look->up] + box->high[look->up]) / 2}};
}

static void place(const struct sheet *sheet, struct vec3 p, double at[2])
{
	at[0] = SIZE / 2 + (axis_of(p, sheet->look.right) - sheet->middle[0]) * sheet->scale;
	at[1] = SIZE / 2 - (axis_of(p, sheet->look.up) - sheet->middle[1]) * sheet->scale;
}

/* A length for the ruler: 1, 2 or 5 of a power of ten, a quarter of the drawing or less. */
static double ruler_m(double scale)
{
	double most = SIZE / 4 / scale, ten = pow(10, floor(log10(most)));

	return most >= 5 * ten ? 5 * ten : most >= 2 * ten ? 2 * ten : ten;
}

static void begin_sheet(FILE *file, const struct sheet *sheet)
{
	double ruler = ruler_m(sheet->scale);

	fprintf(file,
		"<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\">\n"
		"<rect width=\"%.0f\" height=\"%.0f\" class=\"frame\"/>\n",
		SIZE, SIZE, SIZE, SIZE, SIZE, SIZE);
	fprintf(file,
		"<text x=\"8\" y=\"18\">%c to the right, %c up</text>\n"
		"<path class=\"ruler\" d=\"M8 %.0fh%.1f\"/><text x=\"8\" y=\"%.0f\">%g m</text>\n",
		"xyz"[sheet->look.right], "xyz"[sheet->look.up], SIZE - 10, ruler * sheet->scale,
		SIZE - 16, ruler);
}

static struct vec3 to_stage(const struct report_facts *facts, struct vec3 p_ref_m)
{
	return pose_apply(&facts->rig->rt_stage_ref, p_ref_m);
}

static struct vec3 board_middle(const struct report_facts *facts, uint32_t nth)
{
	const struct board *board = &facts->rig->observations->board;
	struct pose rt_ref_board = pose_from_rt(facts->rig->solution->rt_ref_board[nth]);
	struct vec3 middle = {board->square_m * (board_corners_x(board) - 1) / 2,
			      board->square_m * (board_corners_y(board) - 1) / 2, 0};

	return to_stage(facts, pose_apply(&rt_ref_board, middle));
}

/* A pyramid as wide as the camera sees. */
static void print_camera(FILE *file, const struct report_facts *facts, const struct sheet *sheet,
			 uint32_t c)
{
	const struct observed_camera *camera = &facts->rig->observations->cameras[c];
	const struct solution *s = facts->rig->solution;
	const double *focal_px = s->intrinsics + (size_t)c * s->lens_count;
	double length_m = FRUSTUM_PART * SIZE / sheet->scale, tip[2], at[4][2];
	struct pose rt_cam_ref = pose_from_rt(s->rt_cam_ref[c]);
	struct pose rt_ref_cam = pose_inverse(&rt_cam_ref);

	place(sheet, to_stage(facts, rt_ref_cam.t), tip);
	fprintf(file, "<path class=\"camera\" d=\"");
	for (int i = 0; i < 4; i++) {
		double x = (i == 1 || i == 2 ? 0.5 : -0.5) * camera->width_px / focal_px[0];
		double y = (i >= 2 ? 0.5 : -0.5) * camera->height_px / focal_px[1];
		struct vec3 corner = {length_m * x, length_m * y, length_m};

		place(sheet, to_stage(facts, pose_apply(&rt_ref_cam, corner)), at[i]);
		fprintf(file, "M%.1f %.1fL%.1f %.1f", tip[0], tip[1], at[i][0], at[i][1]);
	}
	fprintf(file, "M%.1f %.1fL%.1f %.1fL%.1f %.1fL%.1f %.1fz", at[0][0], at[0][1], at[1][0],
		at[1][1], at[2][0], at[2][1], at[3][0], at[3][1]);
	fprintf(file, "\"/><circle class=\"tip\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>", tip[0],
		tip[1]);
	fprintf(file, "<text x=\"%.1f\" y=\"%.1f\">%s</text>\n", tip[0] + 5, tip[1] - 5,
		camera->name);
}

static void print_cameras(FILE *file, const struct report_facts *facts)
{
	const struct solution *s = facts->rig->solution;
	struct vec3 first = to_stage(facts, solution_centre_m(s, 0));
	struct box box = {{first.x, first.y, first.z}, {first.x, first.y, first.z}};

	for (uint32_t c = 0; c < s->camera_count; c++)
		box_add(&box, to_stage(facts, solution_centre_m(s, c)));
	for (uint32_t n = 0; n < s->pose_count; n++)
		box_add(&box, board_middle(facts, n));
	for (size_t i = 0; i < LOOK_COUNT; i++) {
		struct sheet sheet = sheet_of(&box, &LOOKS[i]);
		double at[2];

		begin_sheet(file, &sheet);
		fprintf(file, "<path class=\"boards\" d=\"");
		for (uint32_t n = 0; n < s->pose_count; n++) {
			place(&sheet, board_middle(facts, n), at);
			fprintf(file, "M%.1f %.1fh0", at[0], at[1]);
		}
		fprintf(file, "\"/>\n");
		for (uint32_t c = 0; c < s->camera_count; c++)
			print_camera(file, facts, &sheet, c);
		fprintf(file, "</svg>\n");
	}
}

/* From calm to hot, `part` 0 to 1, as "#rrggbb". */
static void find_colour(double part, char colour[8])
{
	static const double calm[3] = {58, 134, 168}, warm[3] = {240, 190, 80},
			    hot[3] = {200, 50, 60};
	double p = fmin(fmax(part, 0), 1) * 2;
	const double *from = p < 1 ? calm : warm, *to = p < 1 ? warm : hot;
	int rgb[3];

	p = p < 1 ? p : p - 1;
	for (int i = 0; i < 3; i++)
		rgb[i] = (int)(from[i] + (to[i] - from[i]) * p);
	snprintf(colour, 8, "#%02x%02x%02x", rgb[0] & 255, rgb[1] & 255, rgb[2] & 255);
}

static double sigma_mm(const struct uncertainty *u, uint32_t i)
{
	return 1e3 * sqrt(u->cov_m2[i][0][0] + u->cov_m2[i][1][1] + u->cov_m2[i][2][2]);
}

/* Points that fall on one another stand side by side a little, by their depth. */
static void print_points(FILE *file, const struct report_facts *facts, const struct sheet *sheet)
{
	const struct volume *volume = facts->rig->volume;
	const struct uncertainty *u = facts->rig->uncertainty;
	double limit_mm = 1e3 * u->worst_m, at[2];
	char colour[8];

	for (uint32_t i = 0; i < volume->count; i++) {
		struct vec3 p = to_stage(facts, volume->p_ref_m[i]);

		place(sheet, p, at);
		find_colour(sigma_mm(u, i) / limit_mm, colour);
		fprintf(file,
			"<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"%s\" "
			"fill-opacity=\"0.75\">"
			"<title>%.3f mm at (%.2f, %.2f, %.2f), %d cameras</title></circle>\n",
			at[0], at[1], 3 + 8 * sigma_mm(u, i) / limit_mm, colour, sigma_mm(u, i),
			p.x, p.y, p.z, __builtin_popcount(volume->camera_mask[i]));
	}
	place(sheet, to_stage(facts, volume->p_ref_m[u->worst]), at);
	fprintf(file,
		"<circle class=\"worst\" cx=\"%.1f\" cy=\"%.1f\" r=\"14\"/>"
		"<text x=\"%.1f\" y=\"%.1f\">%.3f mm</text>\n",
		at[0], at[1], at[0] - 20, at[1] - 18, limit_mm);
}

static void print_volume(FILE *file, const struct report_facts *facts)
{
	const struct volume *volume = facts->rig->volume;
	struct vec3 first = to_stage(facts, volume->p_ref_m[0]);
	struct box box = {{first.x, first.y, first.z}, {first.x, first.y, first.z}};

	for (uint32_t i = 0; i < volume->count; i++)
		box_add(&box, to_stage(facts, volume->p_ref_m[i]));
	for (size_t i = 0; i < LOOK_COUNT; i++) {
		struct sheet sheet = sheet_of(&box, &LOOKS[i]);

		begin_sheet(file, &sheet);
		print_points(file, facts, &sheet);
		fprintf(file, "</svg>\n");
	}
}

void report_space_print(FILE *file, const struct report_facts *facts)
{
	fprintf(file,
		"<h2>Uncertainty over the volume</h2>\n<p>How far a point may be off because "
		"the calibration is: one sigma, larger and redder where it is worse. The ring "
		"is the worst place: wave there next time.</p>\n<div class=\"row\">\n");
	print_volume(file, facts);
	fprintf(file,
		"</div>\n<h2>Cameras</h2>\n<p>In stage coordinates; small dots are the middles "
		"of the board.</p>\n<div class=\"row\">\n");
	print_cameras(file, facts);
	fprintf(file, "</div>\n");
}
