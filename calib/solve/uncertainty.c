/*
 * Covariance of points: g' N^-1 (J'J of corners) N^-1 g, with N the normal matrix, g a point's
 * derivative by the state.
 */
#include "calib/solve/uncertainty.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <suitesparse/cholmod.h>

#include "calib/board/sight.h"
#include "calib/solve/problem.h"
#include "calib/solve/small_solve.h"

/* Derivatives of all points, a column of `states` per axis and point, as CHOLMOD has dense
 * matrices. */
struct derivatives {
	cholmod_dense *by_state;
	size_t states;
	const struct problem *problem;
	const struct solution *solution;
	double *scales;  /* of the state: real units per packed one */
	double *by_lens; /* room for one camera */
};

static double *column(const struct derivatives *d, uint32_t point, int axis)
{
	return (double *)d->by_state->x + (3 * (size_t)point + (size_t)axis) * d->states;
}

/* What one number of the state does to a point: -A^-1 (what it does to the pixels, back-projected).
 * `inverse` is A^-1 by columns. */
static void set_state(struct derivatives *d, uint32_t point, double inverse[3][3],
		      const struct sight *sight, size_t state, double by_x, double by_y)
{
	double pulled[3];

	for (int k = 0; k < 3; k++)
		pulled[k] = sight->by_point[0][k] * by_x + sight->by_point[1][k] * by_y;
	for (int axis = 0; axis < 3; axis++)
		column(d, point, axis)[state] = -d->scales[state] * (inverse[axis][0] * pulled[0] +
								     inverse[axis][1] * pulled[1] +
								     inverse[axis][2] * pulled[2]);
}

/* The state: lens numbers of all cameras, then poses of all but camera 0. */
static void set_camera(struct derivatives *d, uint32_t point, uint32_t camera, double inverse[3][3],
		       const struct sight *sight)
{
	const struct problem *p = d->problem;
	size_t lens_states =
		(size_t)mrcal_num_intrinsics_optimization_params(p->selections, &p->lens);
	size_t lens_count = (size_t)p->lens_count, skipped = lens_count - lens_states;
	size_t poses_at = (size_t)p->camera_count * lens_states;

	for (size_t i = 0; i < lens_states; i++)
		set_state(d, point, inverse, sight, camera * lens_states + i,
			  d->by_lens[skipped + i], d->by_lens[lens_count + skipped + i]);
	for (size_t i = 0; camera > 0 && i < 6; i++)
		set_state(d, point, inverse, sight, poses_at + (camera - 1) * 6 + i,
			  sight->by_pose[0][i], sight->by_pose[1][i]);
}

static int invert(double inverse[3][3], const double a[9])
{
	for (int k = 0; k < 3; k++) {
		double copy[9];

		memcpy(copy, a, sizeof(copy));
		memset(inverse[k], 0, sizeof(inverse[k]));
		inverse[k][k] = 1;
		if (small_solve(3, copy, inverse[k]))
			return -EDOM;
	}
	return 0;
}

static int set_point(struct derivatives *d, const struct volume *volume, uint32_t point)
{
	double a[9] = {0}, unused[3] = {0}, inverse[3][3];
	struct sight sight;

	for (uint32_t c = 0; c < d->solution->camera_count; c++) {
		if (!(volume->camera_mask[point] & 1U << c))
			continue;
		if (!solution_sight(d->solution, c, volume->p_ref_m[point], &sight, NULL))
			return -EDOM;
		for (int i = 0; i < 2; i++)
			small_solve_add(3, a, unused, sight.by_point[i], 0, 1);
	}
	if (invert(inverse, a))
		return -EDOM;
	for (uint32_t c = 0; c < d->solution->camera_count; c++) {
		if (!(volume->camera_mask[point] & 1U << c))
			continue;
		solution_sight(d->solution, c, volume->p_ref_m[point], &sight, d->by_lens);
		set_camera(d, point, c, inverse, &sight);
	}
	return 0;
}

static struct vec3 middle_of(const struct volume *volume)
{
	struct vec3 sum = {0, 0, 0};

	for (uint32_t i = 0; i < volume->count; i++)
		sum = vec3_add(sum, volume->p_ref_m[i]);
	return vec3_scale(sum, 1.0 / volume->count);
}

/* How point `p` moves along an axis when all move rigidly: three translations, three rotations. */
static void rigid_row(struct vec3 p, int axis, double row[6])
{
	const double rows[3][6] = {
		{1, 0, 0, 0, p.z, -p.y}, {0, 1, 0, -p.z, 0, p.x}, {0, 0, 1, p.y, -p.x, 0}};

	memcpy(row, rows[axis], sizeof(rows[axis]));
}

/* Takes out of every state's effect what is a rigid motion of all points. */
static int remove_rigid(struct derivatives *d, const struct volume *volume)
{
	struct vec3 middle = middle_of(volume);

	for (size_t s = 0; s < d->states; s++) {
		double a[36] = {0}, motion[6] = {0}, row[6];

		for (uint32_t i = 0; i < volume->count; i++)
			for (int axis = 0; axis < 3; axis++) {
				rigid_row(vec3_sub(volume->p_ref_m[i], middle), axis, row);
				small_solve_add(6, a, motion, row, column(d, i, axis)[s], 1);
			}
		if (small_solve(6, a, motion))
			return -EDOM;
		for (uint32_t i = 0; i < volume->count; i++)
			for (int axis = 0; axis < 3; axis++) {
				rigid_row(vec3_sub(volume->p_ref_m[i], middle), axis, row);
				for (int k = 0; k < 6; k++)
					column(d, i, axis)[s] -= row[k] * motion[k];
			}
	}
	return 0;
}

/* Product of two vectors under the normal matrix of the regularisation alone. */
static double regularised(const cholmod_sparse *jt, size_t corner_rows, const double *v,
			  const double *w)
{
	const int *p = jt->p, *index = jt->i;
	const double *x = jt->x;
	double sum = 0;

	for (size_t row = corner_rows; row < jt->ncol; row++) {
		double by_v = 0, by_w = 0;

		for (int k = p[row]; k < p[row + 1]; k++) {
			by_v += x[k] * v[index[k]];
			by_w += x[k] * w[index[k]];
		}
		sum += by_v * by_w;
	}
	return sum;
}

/* v = N^-1 g: the covariance is g'v less what the regularisation has in it, times sigma^2. */
static void read_covariance(struct uncertainty *u, const struct derivatives *d,
			    const cholmod_dense *solved, const cholmod_sparse *jt)
{
	double variance = d->solution->sigma_px * d->solution->sigma_px;
	size_t corner_rows = 2 * (size_t)d->problem->view_count * (size_t)d->problem->corner_count;
	double sum = 0;

	for (uint32_t i = 0; i < u->count; i++) {
		const double *v = (const double *)solved->x + 3 * (size_t)i * d->states;

		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++) {
				const double *g = column(d, i, a), *w = v + (size_t)b * d->states;
				double product = 0;

				for (size_t s = 0; s < d->states; s++)
					product += g[s] * w[s];
				product -=
					regularised(jt, corner_rows, v + (size_t)a * d->states, w);
				u->cov_m2[i][a][b] = variance * product;
			}
		double square = u->cov_m2[i][0][0] + u->cov_m2[i][1][1] + u->cov_m2[i][2][2];
		sum += square;
		if (sqrt(square) > u->worst_m) {
			u->worst_m = sqrt(square);
			u->worst = i;
		}
	}
	u->rms_m = sqrt(sum / u->count);
}

static int solve_normal(struct uncertainty *u, const struct derivatives *d, cholmod_sparse *jt,
			cholmod_common *common)
{
	cholmod_factor *factor = cholmod_analyze(jt, common);
	int err = factor ? -EDOM : -ENOMEM;

	if (factor && cholmod_factorize(jt, factor, common) && common->status == CHOLMOD_OK) {
		cholmod_dense *solved = cholmod_solve(CHOLMOD_A, factor, d->by_state, common);

		err = solved ? 0 : -ENOMEM;
		if (solved)
			read_covariance(u, d, solved, jt);
		cholmod_free_dense(&solved, common);
	}
	cholmod_free_factor(&factor, common);
	return err;
}

static int differentiate(struct derivatives *d, const struct volume *volume)
{
	int err = 0;

	for (uint32_t i = 0; !err && i < volume->count; i++)
		err = set_point(d, volume, i);
	return err ? err : remove_rigid(d, volume);
}

static int find(struct uncertainty *u, struct problem *problem, const struct solution *solution,
		const struct volume *volume, cholmod_common *common)
{
	size_t states = (size_t)problem_state_count(problem);
	struct derivatives d = {.states = states, .problem = problem, .solution = solution};
	cholmod_sparse *jt = cholmod_allocate_sparse(
		states, (size_t)problem_measurement_count(problem),
		(size_t)problem_entry_room(problem), 1, 1, 0, CHOLMOD_REAL, common);
	double *packed = malloc(states * sizeof(*packed));
	int err = -ENOMEM;

	d.by_state = cholmod_zeros(states, 3 * (size_t)volume->count, CHOLMOD_REAL, common);
	d.scales = malloc(states * sizeof(*d.scales));
	d.by_lens = malloc(2 * solution->lens_count * sizeof(*d.by_lens));
	if (jt && packed && d.by_state && d.scales && d.by_lens)
		err = problem_scales(problem, d.scales);
	if (!err) {
		problem_set(problem, solution);
		err = problem_evaluate(problem, packed, jt);
	}
	if (!err)
		err = differentiate(&d, volume);
	if (!err)
		err = solve_normal(u, &d, jt, common);
	cholmod_free_sparse(&jt, common);
	cholmod_free_dense(&d.by_state, common);
	free(packed);
	free(d.scales);
	free(d.by_lens);
	return err;
}

int uncertainty_find(struct uncertainty *uncertainty, const struct solution *solution,
		     const struct observations *observations, const struct volume *volume)
{
	struct uncertainty made = {.count = volume->count};
	struct problem problem;
	cholmod_common common;
	int err = problem_init_solved(&problem, observations, solution);

	if (err)
		return err;
	cholmod_start(&common);
	common.print = 0;
	err = find(&made, &problem, solution, volume, &common);
	cholmod_finish(&common);
	problem_finish(&problem);
	if (!err)
		*uncertainty = made;
	return err;
}
