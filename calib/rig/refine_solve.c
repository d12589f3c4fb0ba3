/*
 * Bundle adjustment of some cameras and all points: points are taken out of the normal equations
 * (Schur complement; Triggs et al., Bundle adjustment - a modern synthesis, 2000). Views far off
 * count little (Cauchy).
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/rig/refine_parts.h"
#include "calib/solve/small_solve.h"

#define RIG_SIGMA_PX 0.02 /* spots are not trusted more than lenses are known */
#define SCALE_MIN_PX 0.1
#define SHIFT_SIGMA_M 2e-3 /* a bump turns more than it shifts, which small volumes cannot tell */
#define PASSES 12
#define STILL 1e-9 /* rad and m */
#define VIEW_MAX CAMERA_MAX

/* A view, linearised. */
struct lines {
	uint32_t camera;
	double weight, e[2], j[2][3], a[2][REFINE_DOF];
	double b[REFINE_DOF][3], bv[REFINE_DOF][3]; /* A' W J, and that by the point's inverse */
};

static void linearise(struct lines *line, const struct view *view, struct vec3 p_m)
{
	for (int row = 0; row < 2; row++) {
		view_turn(view, p_m, line->j[row], line->a[row]);
		for (int i = 0; i < 3; i++)
			line->a[row][3 + i] = -line->j[row][i];
	}
}

/* Returns how many of the point's views can be projected. */
static uint32_t look(struct refine_problem *problem, const struct refine_point *point,
		     struct lines *lines)
{
	uint32_t count = 0;

	for (uint32_t v = 0; v < point->view_count; v++) {
		struct refine_view *view = &problem->views[point->first_view + v];
		struct lines *line = &lines[count];
		double pixel[2];

		if (!view_project(&problem->cameras[view->camera], point->p_stage_m, pixel,
				  line->j))
			continue;
		for (int row = 0; row < 2; row++)
			line->e[row] = view->off_px[row] = view->px[row] - pixel[row];
		double far = hypot(line->e[0], line->e[1]) / problem->scale_px[view->camera];
		line->camera = view->camera;
		line->weight = 1 / ((1 + far * far) * (view->sigma_px * view->sigma_px +
						       RIG_SIGMA_PX * RIG_SIGMA_PX));
		count++;
	}
	return count;
}

static bool step_of_point(const struct lines *lines, uint32_t count, double v[9], double step[3])
{
	double copy[9];

	memset(v, 0, 9 * sizeof(*v));
	step[0] = step[1] = step[2] = 0;
	for (uint32_t i = 0; i < count; i++)
		for (int row = 0; row < 2; row++)
			small_solve_add(3, v, step, lines[i].j[row], lines[i].e[row],
					lines[i].weight);
	memcpy(copy, v, sizeof(copy));
	return count >= 2 && !small_solve(3, copy, step);
}

static void move_point(struct refine_problem *problem, struct refine_point *point,
		       struct lines *lines)
{
	double v[9], step[3];

	for (int i = 0; i < 2; i++) {
		uint32_t count = look(problem, point, lines);

		if (step_of_point(lines, count, v, step))
			point->p_stage_m = vec3_add(point->p_stage_m,
						    (struct vec3){step[0], step[1], step[2]});
	}
}

/* b by the inverse of v, row by row. */
static bool divide(struct lines *line, const double v[9])
{
	for (int i = 0; i < REFINE_DOF; i++) {
		double copy[9];

		memcpy(copy, v, sizeof(copy));
		for (int k = 0; k < 3; k++) {
			line->b[i][k] = 0;
			for (int row = 0; row < 2; row++)
				line->b[i][k] += line->weight * line->a[row][i] * line->j[row][k];
			line->bv[i][k] = line->b[i][k];
		}
		if (small_solve(3, copy, line->bv[i]))
			return false;
	}
	return true;
}

static void add_camera(struct refine_normal *n, const struct lines *line, const double g[3])
{
	uint32_t c = line->camera;

	for (int i = 0; i < REFINE_DOF; i++) {
		for (int row = 0; row < 2; row++)
			n->pull[c][i] += line->weight * line->a[row][i] * line->e[row];
		for (int k = 0; k < 3; k++)
			n->pull[c][i] -= line->bv[i][k] * g[k];
		for (int m = 0; m < REFINE_DOF; m++) {
			double reach =
				line->a[0][i] * line->a[0][m] + line->a[1][i] * line->a[1][m];
			double gone = 0;

			for (int k = 0; k < 3; k++)
				gone += line->bv[i][k] * line->b[m][k];
			n->reach[c][i][m] += reach;
			n->block[c][i][m] += line->weight * reach - gone;
		}
	}
	n->left_px2[c] += line->weight * (line->e[0] * line->e[0] + line->e[1] * line->e[1]);
	n->weight[c] += line->weight;
	n->view_count[c]++;
}

static int place_of(const struct refine_normal *n, uint32_t camera)
{
	for (uint32_t f = 0; f < n->free_count; f++)
		if (n->free_cameras[f] == camera)
			return (int)f;
	return -1;
}

/* Between two free cameras that see the same point. */
static void add_cross(struct refine_normal *n, const struct lines *one, const struct lines *other)
{
	int at = place_of(n, one->camera), beside = place_of(n, other->camera);
	uint32_t side = REFINE_DOF * n->free_count;

	if (at < 0 || beside < 0)
		return;
	for (int i = 0; i < REFINE_DOF; i++)
		for (int m = 0; m < REFINE_DOF; m++)
			for (int k = 0; k < 3; k++)
				n->cross[(uint32_t)(REFINE_DOF * at + i) * side +
					 (uint32_t)(REFINE_DOF * beside + m)] -=
					one->bv[i][k] * other->b[m][k];
}

static void add_point(struct refine_problem *problem, struct refine_normal *n,
		      struct refine_point *point, struct lines *lines)
{
	double v[9], step[3], g[3] = {0};

	move_point(problem, point, lines);
	uint32_t count = look(problem, point, lines);
	if (!step_of_point(lines, count, v, step))
		return;
	for (uint32_t i = 0; i < count; i++) {
		linearise(&lines[i], &problem->cameras[lines[i].camera], point->p_stage_m);
		if (!divide(&lines[i], v))
			return;
		for (int row = 0; row < 2; row++)
			for (int k = 0; k < 3; k++)
				g[k] += lines[i].weight * lines[i].j[row][k] * lines[i].e[row];
	}
	for (uint32_t i = 0; i < count; i++) {
		add_camera(n, &lines[i], g);
		for (uint32_t k = 0; n->cross && k < count; k++)
			if (k != i)
				add_cross(n, &lines[i], &lines[k]);
	}
}

static void add_prior(const struct refine_problem *problem, struct refine_normal *n)
{
	const double weight = 1 / (SHIFT_SIGMA_M * SHIFT_SIGMA_M);

	for (uint32_t c = 0; c < problem->camera_count; c++) {
		struct vec3 off =
			vec3_sub(problem->centre_m[c], problem->cameras[c].centre_stage_m);
		const double off_m[3] = {off.x, off.y, off.z};

		for (int i = 0; i < 3; i++) {
			n->block[c][3 + i][3 + i] += weight;
			n->pull[c][3 + i] += weight * off_m[i];
		}
	}
}

/* Twice the mean distance, from the pass before. */
static void set_scales(struct refine_problem *problem, const struct refine_normal *n)
{
	for (uint32_t c = 0; c < problem->camera_count; c++) {
		double rms_px = n->weight[c] > 0 ? sqrt(n->left_px2[c] / n->weight[c]) : 0;

		problem->scale_px[c] = fmax(SCALE_MIN_PX, 2 * rms_px);
	}
}

void refine_pass(struct refine_problem *problem, struct refine_normal *n)
{
	struct lines lines[VIEW_MAX];
	uint32_t side = REFINE_DOF * n->free_count;

	for (uint32_t c = 0; c < problem->camera_count && problem->scale_px[c] == 0; c++)
		problem->scale_px[c] = REFINE_OFF_MAX_PX;
	memset(n->block, 0, sizeof(n->block));
	memset(n->pull, 0, sizeof(n->pull));
	memset(n->reach, 0, sizeof(n->reach));
	memset(n->left_px2, 0, sizeof(n->left_px2));
	memset(n->weight, 0, sizeof(n->weight));
	memset(n->view_count, 0, sizeof(n->view_count));
	if (n->cross)
		memset(n->cross, 0, side * side * sizeof(*n->cross));
	for (uint32_t p = 0; p < problem->point_count; p++)
		if (!problem->half || problem->points[p].shot % 2 == (uint32_t)problem->half - 1)
			add_point(problem, n, &problem->points[p], lines);
	add_prior(problem, n);
	set_scales(problem, n);
}

static void move_camera(struct view *view, const double step[REFINE_DOF])
{
	struct pose turn = pose_from_rotation_vector((struct vec3){step[0], step[1], step[2]});
	struct pose rt_stage_cam = pose_inverse(&view->rt_cam_stage);
	struct vec3 centre_m = vec3_add(rt_stage_cam.t, (struct vec3){step[3], step[4], step[5]});

	rt_stage_cam = pose_compose(&turn, &rt_stage_cam);
	rt_stage_cam.t = centre_m;
	view->rt_cam_stage = pose_inverse(&rt_stage_cam);
	view->centre_stage_m = centre_m;
}

/* One step of the free cameras; the largest part of it. */
static int step_cameras(struct refine_problem *problem, struct refine_normal *n, double *step,
			double *most)
{
	uint32_t side = REFINE_DOF * n->free_count;

	for (uint32_t f = 0; f < n->free_count; f++)
		for (uint32_t i = 0; i < REFINE_DOF; i++) {
			uint32_t c = n->free_cameras[f], at = REFINE_DOF * f;

			step[at + i] = n->pull[c][i];
			for (uint32_t m = 0; m < REFINE_DOF; m++)
				n->cross[(at + i) * side + at + m] = n->block[c][i][m];
		}
	if (small_solve((int)side, n->cross, step))
		return -EDOM;
	*most = 0;
	for (uint32_t f = 0; f < n->free_count; f++)
		move_camera(&problem->cameras[n->free_cameras[f]], step + REFINE_DOF * f);
	for (uint32_t i = 0; i < side; i++)
		*most = fmax(*most, fabs(step[i]));
	return 0;
}

int refine_solve(struct refine_problem *problem, struct refine_normal *n)
{
	uint32_t side = REFINE_DOF * n->free_count;
	double *step = calloc(side + 1, sizeof(*step)), most = 1;
	int err = 0;

	n->cross = calloc(side * side + 1, sizeof(*n->cross));
	if (!step || !n->cross)
		err = -ENOMEM;
	for (int pass = 0; !err && side && pass < PASSES && most > STILL; pass++) {
		refine_pass(problem, n);
		err = step_cameras(problem, n, step, &most);
	}
	free(n->cross);
	n->cross = NULL;
	free(step);
	if (!err)
		refine_pass(problem, n);
	return err;
}

double refine_explain(const struct refine_normal *n, uint32_t c, double step[REFINE_DOF],
		      double *off_px)
{
	double block[REFINE_DOF * REFINE_DOF], explained = 0, off2 = 0;

	memcpy(block, n->block[c], sizeof(block));
	memcpy(step, n->pull[c], sizeof(n->pull[c]));
	if (!n->view_count[c] || small_solve(REFINE_DOF, block, step))
		return 0;
	for (int i = 0; i < REFINE_DOF; i++) {
		explained += step[i] * n->pull[c][i];
		for (int m = 0; m < REFINE_DOF; m++)
			off2 += step[i] * n->reach[c][i][m] * step[m];
	}
	*off_px = sqrt(fmax(0, off2) / n->view_count[c]);
	return explained;
}
