/*
 * Fills a view's tables from a lens model. Inside the image the model is asked and must invert.
 * Beyond the border, where models may explode or fold back, cubic extrapolation decides what is
 * plausible and the model is believed only within a pixel of that. Then the result is checked
 * against the model in every cell of the image.
 */
#include <errno.h>
#include <string.h>

#include "track/view.h"

/* Between nodes. As wide as the error allows: tables that fit the cache are worth more than any
 * saving in arithmetic, once the frames of eight cameras have gone through it. */
#define STEP_MAX_PX 32.0
#define STEP_MIN_PX 2.0
#define ERROR_GOAL_PX 1.5e-4  /* of the finished tables against the model, where it is tried */
#define ERROR_MAX_PX 0.01     /* ... at the smallest step */
#define PLAUSIBLE_PX 1.0      /* of the model against the extrapolation, outside the image */
#define PLANE_NODES_MAX 1e6   /* a wide and odd lens gets a coarser table, not an endless one */
#define INVERSE_ERROR_PX 1e-6 /* of a node */
#define DIFFERENCE 1e-5       /* in the stereographic plane: about 0.01 px */
#define NEWTON_STEPS_MAX 20

struct build {
	struct view *view;
	const struct lens_model *model;
	struct lens_grid *plane; /* the view's pixel_to_plane */
	double step_px;
};

static void pixel_of(const struct build *b, int x, int y, double q[2])
{
	q[0] = b->plane->x0 + x * b->plane->x_step;
	q[1] = b->plane->y0 + y * b->plane->y_step;
}

static double distance2(const double a[2], const double b[2])
{
	return hypot(a[0] - b[0], a[1] - b[1]);
}

/* The model's pixel of a place in the stereographic plane. */
static bool model_project(const struct lens_model *model, const double u[2], double q[2])
{
	double m = (u[0] * u[0] + u[1] * u[1]) / 4.0;
	struct vec3 v = {u[0], u[1], 1.0 - m};

	return model->project(model->user, v, q) && isfinite(q[0]) && isfinite(q[1]);
}

/* One Newton step towards the place whose pixel is `q`, with central differences. */
static bool polish_place(const struct lens_model *model, const double q[2], double u[2])
{
	double at[2], j[2][2];

	for (int k = 0; k < 2; k++) {
		double a[2] = {u[0], u[1]}, b[2] = {u[0], u[1]}, low[2], high[2];

		a[k] -= DIFFERENCE;
		b[k] += DIFFERENCE;
		if (!model_project(model, a, low) || !model_project(model, b, high))
			return false;
		for (int i = 0; i < 2; i++)
			j[i][k] = (high[i] - low[i]) / (2 * DIFFERENCE);
	}
	if (!model_project(model, u, at))
		return false;

	double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
	double dx = q[0] - at[0], dy = q[1] - at[1];

	u[0] += (j[1][1] * dx - j[0][1] * dy) / det;
	u[1] += (j[0][0] * dy - j[1][0] * dx) / det;
	return true;
}

/* The place in the stereographic plane of a pixel, true only if it projects back to it.
 * Iterative unprojections stop early (some 1e-2 px off): one or two steps more. */
static bool model_unproject(const struct lens_model *model, const double q[2], double u[2])
{
	struct vec3 v;
	double back[2];

	if (!model->unproject(model->user, q, &v))
		return false;

	double s = v.z + vec3_norm(v);
	double place[2] = {2 * v.x / s, 2 * v.y / s};

	if (!(s > 0))
		return false;
	for (int i = 0; i < 3; i++) {
		if (!model_project(model, place, back))
			return false;
		if (distance2(q, back) < INVERSE_ERROR_PX) {
			memcpy(u, place, sizeof(place));
			return true;
		}
		if (!polish_place(model, q, place))
			return false;
	}
	return false;
}

static int sample_image(const struct build *b, double bad_pixel[2])
{
	const struct lens_grid *grid = b->plane;

	for (int y = VIEW_PAD; y < grid->y_count - VIEW_PAD; y++)
		for (int x = VIEW_PAD; x < grid->x_count - VIEW_PAD; x++) {
			double q[2];

			pixel_of(b, x, y, q);
			if (!model_unproject(b->model, q, lens_grid_node(grid, x, y))) {
				memcpy(bad_pixel, q, sizeof(q));
				return -EDOM;
			}
		}
	return 0;
}

/* Fills the node (x, y) from the four behind it in the direction (dx, dy). */
static void extend_node(const struct build *b, int x, int y, int dx, int dy)
{
	double *node = lens_grid_node(b->plane, x, y), q[2], u[2];
	const double *inner[4];

	for (int i = 0; i < 4; i++)
		inner[i] = lens_grid_node(b->plane, x - (i + 1) * dx, y - (i + 1) * dy);
	for (int k = 0; k < 2; k++)
		node[k] = 4 * inner[0][k] - 6 * inner[1][k] + 4 * inner[2][k] - inner[3][k];
	pixel_of(b, x, y, q);
	if (model_unproject(b->model, q, u) &&
	    distance2(u, node) < PLAUSIBLE_PX * distance2(inner[0], inner[1]) / b->step_px)
		memcpy(node, u, sizeof(u));
}

static void extend_beyond_image(const struct build *b)
{
	int x_end = b->plane->x_count - 1, y_end = b->plane->y_count - 1;

	for (int ring = VIEW_PAD - 1; ring >= 0; ring--)
		for (int y = VIEW_PAD; y <= y_end - VIEW_PAD; y++) {
			extend_node(b, ring, y, -1, 0);
			extend_node(b, x_end - ring, y, 1, 0);
		}
	for (int ring = VIEW_PAD - 1; ring >= 0; ring--)
		for (int x = 0; x <= x_end; x++) {
			extend_node(b, x, ring, 0, -1);
			extend_node(b, x, y_end - ring, 0, 1);
		}
}

static int build_pixel_to_plane(const struct build *b, double bad_pixel[2])
{
	int x_cells = (int)ceil((b->view->width_px - 1) / b->step_px);
	int y_cells = (int)ceil((b->view->height_px - 1) / b->step_px);
	int err = lens_grid_init(b->plane, x_cells + 1 + 2 * VIEW_PAD, y_cells + 1 + 2 * VIEW_PAD);

	if (err)
		return err;
	/* nodes lie exactly on the first and the last pixel */
	b->plane->x_step = (double)(b->view->width_px - 1) / x_cells;
	b->plane->y_step = (double)(b->view->height_px - 1) / y_cells;
	b->plane->x0 = -VIEW_PAD * b->plane->x_step;
	b->plane->y0 = -VIEW_PAD * b->plane->y_step;
	err = sample_image(b, bad_pixel);
	if (!err)
		extend_beyond_image(b);
	return err;
}

/* Smallest distance of neighbouring nodes inside the image: what a step of the inverse table may
 * be so that it is nowhere coarser than this one. */
static double smallest_step(const struct lens_grid *grid)
{
	double smallest = INFINITY;

	for (int y = VIEW_PAD + 1; y < grid->y_count - VIEW_PAD; y++)
		for (int x = VIEW_PAD + 1; x < grid->x_count - VIEW_PAD; x++) {
			const double *node = lens_grid_node(grid, x, y);

			smallest = fmin(smallest, distance2(node, lens_grid_node(grid, x - 1, y)));
			smallest = fmin(smallest, distance2(node, lens_grid_node(grid, x, y - 1)));
		}
	return smallest;
}

static int allocate_plane_to_pixel(const struct build *b)
{
	struct lens_grid *grid = &b->view->plane_to_pixel;
	double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};

	for (long i = 0; i < (long)b->plane->x_count * b->plane->y_count; i++)
		for (int k = 0; k < 2; k++) {
			low[k] = fmin(low[k], b->plane->node[i][k]);
			high[k] = fmax(high[k], b->plane->node[i][k]);
		}

	double step = fmax(smallest_step(b->plane),
			   sqrt((high[0] - low[0]) * (high[1] - low[1]) / PLANE_NODES_MAX));

	step = fmax(step, fmax(high[0] - low[0], high[1] - low[1]) / (PLANE_NODES_MAX / 100));
	if (!isfinite(step) || !(step > 0))
		return -EDOM;
	grid->x0 = low[0];
	grid->y0 = low[1];
	grid->x_step = grid->y_step = step;
	return lens_grid_init(grid, (int)fmax(4, ceil((high[0] - low[0]) / step) + 1),
			      (int)fmax(4, ceil((high[1] - low[1]) / step) + 1));
}

/* Solves pixel_to_plane(q) = u by Newton's method from the pixel `q` on. */
static bool invert_table(const struct lens_grid *grid, const double u[2], double q[2])
{
	double x_last = grid->x0 + (grid->x_count - 1) * grid->x_step;
	double y_last = grid->y0 + (grid->y_count - 1) * grid->y_step;

	for (int i = 0; i < NEWTON_STEPS_MAX; i++) {
		double at[2], j[2][2];

		lens_grid_at(grid, q[0], q[1], at, j);
		double det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
		double du = u[0] - at[0], dv = u[1] - at[1];
		double dx = (j[1][1] * du - j[0][1] * dv) / det;
		double dy = (j[0][0] * dv - j[1][0] * du) / det;

		q[0] = fmax(grid->x0, fmin(q[0] + dx, x_last));
		q[1] = fmax(grid->y0, fmin(q[1] + dy, y_last));
		if (fabs(dx) + fabs(dy) < 1e-9)
			return true;
	}
	return false;
}

static void fill_plane_row(const struct build *b, int y)
{
	const struct lens_grid *grid = &b->view->plane_to_pixel;
	bool found = false;
	double q[2], model_q[2];

	for (int x = 0; x < grid->x_count; x++) {
		double u[2] = {grid->x0 + x * grid->x_step, grid->y0 + y * grid->y_step};
		double *node = lens_grid_node(grid, x, y);

		if (!found) { /* else the neighbour's solution is the start */
			q[0] = b->view->width_px / 2.0;
			q[1] = b->view->height_px / 2.0;
		}
		found = invert_table(b->plane, u, q);
		if (!found)
			continue;
		bool plausible =
			model_project(b->model, u, model_q) && distance2(q, model_q) < PLAUSIBLE_PX;
		memcpy(node, plausible ? model_q : q, sizeof(q));
	}
}

/* Error of the tables against the model at one pixel; infinite where they fold. */
static double error_at(const struct build *b, const double q[2], double orientation)
{
	double u[2], j[2][2], model_q[2], table_q[2];

	lens_grid_at(b->plane, q[0], q[1], u, j);
	lens_grid_at(&b->view->plane_to_pixel, u[0], u[1], table_q, NULL);

	if (!model_project(b->model, u, model_q))
		return INFINITY;

	double error = fmax(distance2(q, model_q), distance2(q, table_q));
	bool folded = !((j[0][0] * j[1][1] - j[0][1] * j[1][0]) * orientation > 0);

	return folded || !isfinite(error) ? INFINITY : error;
}

/* The worst error over the image, taken in the middle of every cell, and where it is. */
static double worst_error(const struct build *b, double worst_pixel[2])
{
	double u[2], j[2][2], worst = 0;

	lens_grid_at(b->plane, b->view->width_px / 2.0, b->view->height_px / 2.0, u, j);
	double orientation = j[0][0] * j[1][1] - j[0][1] * j[1][0];

	for (int y = VIEW_PAD; y < b->plane->y_count - VIEW_PAD - 1; y++)
		for (int x = VIEW_PAD; x < b->plane->x_count - VIEW_PAD - 1; x++) {
			double q[2];

			pixel_of(b, x, y, q);
			q[0] += b->plane->x_step / 2;
			q[1] += b->plane->y_step / 2;
			double error = error_at(b, q, orientation);
			if (error > worst) {
				worst = error;
				memcpy(worst_pixel, q, sizeof(q));
			}
		}
	return worst;
}

/* Builds both tables at b->step_px. */
static int build_tables(const struct build *b, double *error_px, double bad_pixel[2])
{
	int err = build_pixel_to_plane(b, bad_pixel);

	if (!err)
		err = allocate_plane_to_pixel(b);
	if (err)
		return err;
	for (int y = 0; y < b->view->plane_to_pixel.y_count; y++)
		fill_plane_row(b, y);
	*error_px = worst_error(b, bad_pixel);
	return 0;
}

/* Halves the step until the tables are good, which they nearly always are at once. */
static int build_good_tables(struct build *b, double bad_pixel[2])
{
	double error_px = INFINITY;

	for (b->step_px = STEP_MAX_PX; b->step_px >= STEP_MIN_PX; b->step_px /= 2) {
		lens_grid_finish(&b->view->pixel_to_plane);
		lens_grid_finish(&b->view->plane_to_pixel);
		int err = build_tables(b, &error_px, bad_pixel);
		if (err)
			return err;
		if (error_px <= ERROR_GOAL_PX)
			return 0;
	}
	return error_px <= ERROR_MAX_PX ? 0 : -EDOM;
}

int view_init(struct view *view, int width_px, int height_px, struct pose rt_cam_stage,
	      const struct lens_model *model, double bad_pixel[2])
{
	struct view made = {.width_px = width_px, .height_px = height_px};
	struct build b = {.view = &made, .model = model, .plane = &made.pixel_to_plane};
	double bad[2] = {0, 0};

	if (width_px < VIEW_SIZE_MIN_PX || height_px < VIEW_SIZE_MIN_PX)
		return -EINVAL;
	made.rt_cam_stage = rt_cam_stage;
	made.centre_stage_m = pose_inverse(&rt_cam_stage).t;

	int err = build_good_tables(&b, bad);

	if (err) {
		memcpy(bad_pixel, bad, sizeof(bad));
		view_finish(&made);
		return err;
	}
	*view = made;
	return 0;
}

void view_finish(struct view *view)
{
	lens_grid_finish(&view->pixel_to_plane);
	lens_grid_finish(&view->plane_to_pixel);
	memset(view, 0, sizeof(*view));
}
