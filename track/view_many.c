/*
 * Projections of many points side by side, for none to wait for the roots and quotients of another.
 * Built for any processor, and for those that have AVX2: with the same bits as one by one, for each
 * point's sums keep their order and nothing is fused.
 */
#include "track/view_many.h"

#include <stddef.h>

#include "track/lens_grid_parts.h"
#include "track/view_parts.h"

#define SIDE 16 /* points at once: enough for their roots and quotients to overlap */

struct passages {
	double x[SIDE], y[SIDE], z[SIDE], norm[SIDE], s[SIDE], a[SIDE];
};

static void enter(const struct pose *rt_cam_stage, const struct vec3 *p_stage_m,
		  struct passages *out)
{
	for (int i = 0; i < SIDE; i++) {
		struct passage p = passage_enter(rt_cam_stage, p_stage_m[i]);

		out->x[i] = p.x;
		out->y[i] = p.y;
		out->z[i] = p.z;
		out->norm[i] = p.norm;
		out->s[i] = p.s;
		out->a[i] = p.a;
	}
}

static inline struct passage passage_of(const struct passages *p, int i)
{
	return (struct passage){p->x[i], p->y[i], p->z[i], p->norm[i], p->s[i], p->a[i]};
}

/* One coordinate in the grid: the patch, and the weights of its four nodes for the value and for
 * the slope. */
struct places {
	int patch[SIDE];
	double t[SIDE];
	double w[4][SIDE], d[4][SIDE];
};

static void find_places(const double *along, const double *a, double x0, double steps_per_x,
			int count, struct places *out)
{
	for (int i = 0; i < SIDE; i++)
		out->patch[i] =
			lens_grid_patch((along[i] * a[i] - x0) * steps_per_x, count, &out->t[i]);
	for (int i = 0; i < SIDE; i++) {
		double w[4], d[4];

		lens_grid_weigh(out->t[i], w);
		lens_grid_weigh_slope(out->t[i], d);
		for (int k = 0; k < 4; k++) {
			out->w[k][i] = w[k];
			out->d[k][i] = d[k];
		}
	}
}

/* Pixels, and their slopes in steps of the grid. */
struct values {
	double q[2][SIDE], by_x[2][SIDE], by_y[2][SIDE];
};

/* Both components of a node, twice: for the value and for the slope along x. */
typedef double quad __attribute__((vector_size(32)));
typedef double pair __attribute__((vector_size(16)));

static inline quad twice(const double node[2])
{
	return (quad){node[0], node[1], node[0], node[1]};
}

static void interpolate(const struct lens_grid *grid, const struct places *x,
			const struct places *y, struct values *out)
{
	for (int i = 0; i < SIDE; i++) {
		const double(*row)[2] =
			(const double(*)[2])lens_grid_node(grid, x->patch[i] - 1, y->patch[i] - 1);
		quad w[4], sum = {0, 0, 0, 0};
		pair sum_y = {0, 0};

		for (int k = 0; k < 4; k++)
			w[k] = (quad){x->w[k][i], x->w[k][i], x->d[k][i], x->d[k][i]};
		for (int j = 0; j < 4; j++, row += grid->x_count) {
			quad along = w[0] * twice(row[0]) + w[1] * twice(row[1]) +
				     w[2] * twice(row[2]) + w[3] * twice(row[3]);

			sum += y->w[j][i] * along;
			sum_y += y->d[j][i] * (pair){along[0], along[1]};
		}
		for (int k = 0; k < 2; k++) {
			out->q[k][i] = sum[k];
			out->by_x[k][i] = sum[2 + k];
			out->by_y[k][i] = sum_y[k];
		}
	}
}

static void slopes_of(const struct passages *p, const double *by_x, const double *by_y,
		      double steps_per_x, double steps_per_y, const double r[3][3],
		      double slopes[3][SIDE])
{
	for (int i = 0; i < SIDE; i++) {
		struct passage passage = passage_of(p, i);
		double dq_du[2] = {by_x[i] * steps_per_x, by_y[i] * steps_per_y}, dq_dp[3];

		passage_slopes(&passage, dq_du, r, dq_dp);
		for (int j = 0; j < 3; j++)
			slopes[j][i] = dq_dp[j];
	}
}

static void project_side(const struct view *view, const struct vec3 *p_stage_m,
			 struct projection *out, bool *in_sight)
{
	const struct lens_grid *grid = &view->plane_to_pixel;
	double steps_per_x = 1 / grid->x_step, steps_per_y = 1 / grid->y_step;
	double slopes[2][3][SIDE];
	struct passages p;
	struct places x, y;
	struct values v;

	enter(&view->rt_cam_stage, p_stage_m, &p);
	find_places(p.x, p.a, grid->x0, steps_per_x, grid->x_count, &x);
	find_places(p.y, p.a, grid->y0, steps_per_y, grid->y_count, &y);
	interpolate(grid, &x, &y, &v);
	for (int k = 0; k < 2; k++)
		slopes_of(&p, v.by_x[k], v.by_y[k], steps_per_x, steps_per_y, view->rt_cam_stage.r,
			  slopes[k]);
	for (int i = 0; i < SIDE; i++) {
		struct passage passage = passage_of(&p, i);

		for (int k = 0; k < 2; k++) {
			out[i].pixel[k] = v.q[k][i];
			for (int j = 0; j < 3; j++)
				out[i].slopes[k][j] = slopes[k][j][i];
		}
		in_sight[i] = passage_is_seen(&passage) & view_shows(view, out[i].pixel);
	}
}

void VIEW_PROJECT_MANY(const struct view *view, const struct vec3 *p_stage_m, int count,
		       struct projection *out, bool *in_sight)
{
	struct vec3 rest_m[SIDE];
	struct projection rest[SIDE];
	bool rest_in_sight[SIDE];
	int i = 0;

	for (; i + SIDE <= count; i += SIDE)
		project_side(view, p_stage_m + i, out + i, in_sight + i);
	if (i == count)
		return;
	for (int k = 0; k < SIDE; k++)
		rest_m[k] = p_stage_m[i + k < count ? i + k : i];
	project_side(view, rest_m, rest, rest_in_sight);
	for (int k = 0; i + k < count; k++) {
		out[i + k] = rest[k];
		in_sight[i + k] = rest_in_sight[k];
	}
}
