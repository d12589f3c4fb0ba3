/*
 * The lens is inverted at every second pixel each way, by Newton steps from the neighbour, and
 * interpolated in between: corners are right to 0.01 px.
 */
#include "sim/board/board_view.h"

#include <string.h>

#define INK_REFLECTS 0.08f
#define STEP_M 1e-3 /* of the derivatives */
#define CLOSE_PX 1e-3
#define NEWTON_MAX 12
#define NODES_PER_SLOPE 16
#define OUTLINE_STEPS 8
#define BOX_MARGIN_PX 10

/* How the picture moves with the board's place, and its inverse, around one node. */
struct slope {
	double xy_per_px[2][2];
	double smear_m[2];
};

/* The board at one row's time. */
struct row_pose {
	struct pose mid, end; /* end of the exposure */
};

static struct row_pose pose_at_row(const struct board_view *view, double row)
{
	double time_s = exposure_of_row_s(&view->exposure, row, view->camera->height_px);

	return (struct row_pose){
		sim_board_pose(view->board, time_s),
		sim_board_pose(view->board, time_s + 0.5 * view->exposure.length_s)};
}

static bool project(const struct board_view *view, const struct pose *rt, const double xy_m[2],
		    double pixel[2])
{
	return sim_camera_project(
		view->camera, pose_apply(rt, board_point_m(&view->board->print, xy_m[0], xy_m[1])),
		pixel);
}

void board_view_init(struct board_view *view, const struct sim_board *board,
		     const struct board_art *art, const struct sim_camera *camera,
		     double blur_sigma_px, double range_m)
{
	memset(view, 0, sizeof(*view));
	view->board = board;
	view->art = art;
	view->camera = camera;
	view->lens_blur_px = blur_sigma_px;
	view->range_m = range_m;
}

static int clamped(double value, int high)
{
	return value < 0 ? 0 : value > high ? high : (int)value;
}

/* Widens the box by the plate's outline at a time. */
static bool add_outline(const struct board_view *view, double time_s, double low[2], double high[2])
{
	struct pose rt = sim_board_pose(view->board, time_s);
	const float *from = view->art->low_m, *to = view->art->high_m;

	if (!sim_board_faces(&rt, view->camera))
		return false;
	for (int i = 0; i < 4 * OUTLINE_STEPS; i++) {
		int side = i / OUTLINE_STEPS;
		double along = (double)(i % OUTLINE_STEPS) / (OUTLINE_STEPS - 1), pixel[2];
		double across =
			side % 2; /* sides 0 and 1 left and right, 2 and 3 above and below */
		double u = side < 2 ? across : along, v = side < 2 ? along : across;
		double xy_m[2] = {from[0] + u * (to[0] - from[0]), from[1] + v * (to[1] - from[1])};

		if (!project(view, &rt, xy_m, pixel))
			return false;
		for (int k = 0; k < 2; k++) {
			low[k] = fmin(low[k], pixel[k]);
			high[k] = fmax(high[k], pixel[k]);
		}
	}
	return true;
}

/* A disc's variance is a sixteenth of its diameter's square, a pixel's a twelfth. */
static void set_blur(struct board_view *view)
{
	struct pose rt = sim_board_pose(view->board, view->exposure.mid_s);
	double range_m = vec3_distance(rt.t, view->camera->centre_stage_m);
	double disc_px = sim_camera_defocus_px(view->camera, range_m);

	view->blur_px = (float)sqrt(view->lens_blur_px * view->lens_blur_px + 1.0 / 12.0 +
				    disc_px * disc_px / 16.0);
}

void board_view_begin(struct board_view *view, const struct exposure *exposure)
{
	int width = view->camera->width_px, height = view->camera->height_px;
	double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};

	view->exposure = *exposure;
	view->box = (struct pixel_window){0};
	view->node_row = -1;
	view->guess_xy_m[0] = view->guess_xy_m[1] = 0;
	for (int row = 0; row <= height; row += height / 2)
		if (!add_outline(view, exposure_of_row_s(exposure, row, height), low, high))
			return;
	set_blur(view);
	view->box = (struct pixel_window){
		clamped(low[0] - BOX_MARGIN_PX, width), clamped(low[1] - BOX_MARGIN_PX, height),
		clamped(high[0] + BOX_MARGIN_PX, width), clamped(high[1] + BOX_MARGIN_PX, height)};
}

static bool find_slope(const struct board_view *view, const struct row_pose *pose,
		       const double xy_m[2], struct slope *slope)
{
	double here[2], right[2], down[2], later[2];

	if (!project(view, &pose->mid, xy_m, here) ||
	    !project(view, &pose->mid, (double[2]){xy_m[0] + STEP_M, xy_m[1]}, right) ||
	    !project(view, &pose->mid, (double[2]){xy_m[0], xy_m[1] + STEP_M}, down) ||
	    !project(view, &pose->end, xy_m, later))
		return false;
	double a = (right[0] - here[0]) / STEP_M, b = (down[0] - here[0]) / STEP_M;
	double c = (right[1] - here[1]) / STEP_M, d = (down[1] - here[1]) / STEP_M;
	double determinant = a * d - b * c;

	if (fabs(determinant) < 1)
		return false;
	*slope = (struct slope){.xy_per_px = {{d / determinant, -b / determinant},
					      {-c / determinant, a / determinant}}};
	for (int k = 0; k < 2; k++)
		slope->smear_m[k] = 2 * (slope->xy_per_px[k][0] * (later[0] - here[0]) +
					 slope->xy_per_px[k][1] * (later[1] - here[1]));
	return true;
}

static void step(double xy_m[2], const struct slope *slope, double x_px, double y_px)
{
	for (int k = 0; k < 2; k++)
		xy_m[k] += slope->xy_per_px[k][0] * x_px + slope->xy_per_px[k][1] * y_px;
}

/* Moves xy_m until it falls on the pixel. */
static bool settle(const struct board_view *view, const struct row_pose *pose,
		   const struct slope *slope, double x_px, double y_px, double xy_m[2])
{
	for (int i = 0; i < NEWTON_MAX; i++) {
		double pixel[2];

		if (!project(view, &pose->mid, xy_m, pixel))
			return false;
		double off_x = x_px - pixel[0], off_y = y_px - pixel[1];

		step(xy_m, slope, off_x, off_y);
		if (off_x * off_x + off_y * off_y < CLOSE_PX) /* what is left is far smaller */
			return true;
	}
	return false;
}

/* Paper is matt; the light comes from beside the lens. */
static float gain_at(const struct board_view *view, const struct pose *rt, const double xy_m[2])
{
	struct vec3 p = pose_apply(rt, board_point_m(&view->board->print, xy_m[0], xy_m[1]));
	struct vec3 away = {rt->r[0][2], rt->r[1][2], rt->r[2][2]};
	struct vec3 ray = vec3_sub(p, view->camera->centre_stage_m);
	double distance_m = vec3_norm(ray);
	double nearness = view->range_m / distance_m;

	return (float)(fmax(0, vec3_dot(ray, away) / distance_m) * nearness * nearness);
}

static void fill_nodes(struct board_view *view, int node_row, struct board_node *nodes)
{
	double y_px = view->box.y0 + node_row * BOARD_NODE_STEP_PX;
	struct row_pose pose = pose_at_row(view, y_px);
	int count = (view->box.x1 - view->box.x0 + BOARD_NODE_STEP_PX - 1) / BOARD_NODE_STEP_PX + 1;
	double xy_m[2] = {view->guess_xy_m[0], view->guess_xy_m[1]};
	struct slope slope = {0};

	for (int i = 0; i < count; i++) {
		double x_px = view->box.x0 + i * BOARD_NODE_STEP_PX;
		bool found = true;

		for (int again = 0; again < (i == 0 ? 4 : i % NODES_PER_SLOPE == 0); again++) {
			found = find_slope(view, &pose, xy_m, &slope);
			if (found && i == 0)
				found = settle(view, &pose, &slope, x_px, y_px, xy_m);
		}
		found = found && settle(view, &pose, &slope, x_px, y_px, xy_m);
		if (i == 0)
			memcpy(view->guess_xy_m, xy_m, sizeof(xy_m));
		nodes[i] = (struct board_node){
			.xy_m = {(float)xy_m[0], (float)xy_m[1]},
			.smear_m = {(float)slope.smear_m[0], (float)slope.smear_m[1]},
			.gain = gain_at(view, &pose.mid, xy_m)};
		if (!found)
			nodes[i].xy_m[0] = 1e3f; /* off the board */
		step(xy_m, &slope, BOARD_NODE_STEP_PX, 0);
	}
}

static void advance(struct board_view *view, int node_row)
{
	if (node_row == view->node_row)
		return;
	if (view->node_row >= 0 && node_row == view->node_row + 1)
		memcpy(view->nodes[0], view->nodes[1], sizeof(view->nodes[0]));
	else
		fill_nodes(view, node_row, view->nodes[0]);
	fill_nodes(view, node_row + 1, view->nodes[1]);
	view->node_row = node_row;
}

/* The pixels between two columns of nodes: places along the row are linear, blur is the same. */
static void fill_pixels(const struct board_view *view, int column, float down, int count,
			float *light, float *cover)
{
	const struct board_node *a = &view->nodes[0][column], *b = &view->nodes[1][column];
	const float per_node = 1.0f / BOARD_NODE_STEP_PX, per_smear = 1.0f / 12.0f;
	float left[2], along[2], sigma_m[2];
	float gain = 0.25f * (a[0].gain + a[1].gain + b[0].gain + b[1].gain);

	for (int k = 0; k < 2; k++) {
		float right = a[1].xy_m[k] + down * (b[1].xy_m[k] - a[1].xy_m[k]);
		float below = per_node * (b[0].xy_m[k] - a[0].xy_m[k]);

		left[k] = a[0].xy_m[k] + down * (b[0].xy_m[k] - a[0].xy_m[k]);
		along[k] = per_node * (right - left[k]);
		sigma_m[k] = sqrtf(view->blur_px * view->blur_px *
					   (along[k] * along[k] + below * below) +
				   per_smear * a[0].smear_m[k] * a[0].smear_m[k]);
	}
	for (int x = 0; x < count; x++) {
		float xy_m[2] = {left[0] + (float)x * along[0], left[1] + (float)x * along[1]};
		float ink = board_art_ink(view->art, xy_m, sigma_m, &cover[x]);

		light[x] = gain * (cover[x] - (1 - INK_REFLECTS) * ink);
	}
}

void board_view_row(struct board_view *view, int y, float *light, float *cover)
{
	int width = view->box.x1 - view->box.x0, row = y - view->box.y0;
	float down = (float)(row % BOARD_NODE_STEP_PX) / BOARD_NODE_STEP_PX;

	advance(view, row / BOARD_NODE_STEP_PX);
	for (int x = 0; x < width; x += BOARD_NODE_STEP_PX) {
		int count = width - x < BOARD_NODE_STEP_PX ? width - x : BOARD_NODE_STEP_PX;

		fill_pixels(view, x / BOARD_NODE_STEP_PX, down, count, light + x, cover + x);
	}
}
