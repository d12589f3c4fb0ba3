/*
 * Weighted Gauss-Newton triangulation, and the search for a view that does not belong. The search
 * works on the equations of the last step: no view is projected again for it.
 */
#include "track/triangulate.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>

#define ITERATION_MAX 8
/* After a step s the error left is about s^2 over the range: a quarter of a micrometre here. */
#define STEP_DONE_M 5e-4
#define SLOPES_KEPT_M 3e-3  /* after a shorter step they are as good as new */
#define OUTLIER_SIGMA 3.5   /* a view this far off, in its own sigmas, is suspected ... */
#define OUTLIER_MIN_PX 0.12 /* ... unless it is within what calibration leaves */
#define OUTLIER_CHI2 22.0   /* what dropping it must take off: two degrees of freedom, p = 2e-5 */
#define WIDEN_CHI2 4.0 /* per degree of freedom; covariance follows the residuals beyond this */

/* One view's error and its derivative at the point where it was taken. */
struct equation {
	double e[2];         /* pixel seen minus pixel projected */
	struct projection q; /* of the point */
	double weight;       /* 1 / sigma^2 */
};

/* Symmetric 3x3 as xx xy xz yy yz zz. */
static bool sym3_invert(const double a[6], double inv[6])
{
	double c0 = a[3] * a[5] - a[4] * a[4];
	double c1 = a[2] * a[4] - a[1] * a[5];
	double c2 = a[1] * a[4] - a[2] * a[3];
	double det = a[0] * c0 + a[1] * c1 + a[2] * c2;

	if (!(fabs(det) > 1e-12 * fabs(a[0] * a[3] * a[5])))
		return false;
	double scale = 1 / det;
	inv[0] = c0 * scale;
	inv[1] = c1 * scale;
	inv[2] = c2 * scale;
	inv[3] = (a[0] * a[5] - a[2] * a[2]) * scale;
	inv[4] = (a[1] * a[2] - a[0] * a[4]) * scale;
	inv[5] = (a[0] * a[3] - a[1] * a[1]) * scale;
	return true;
}

static struct vec3 sym3_apply(const double a[6], struct vec3 v)
{
	return (struct vec3){a[0] * v.x + a[1] * v.y + a[2] * v.z,
			     a[1] * v.x + a[3] * v.y + a[4] * v.z,
			     a[2] * v.x + a[4] * v.y + a[5] * v.z};
}

int triangulate_rays(const struct sighting *sightings, int count, struct vec3 *out)
{
	double a[6] = {0}, inv[6];
	struct vec3 b = {0, 0, 0};

	for (int i = 0; i < count; i++) {
		struct vec3 d = view_ray(sightings[i].view, sightings[i].pixel);
		struct vec3 c = sightings[i].view->centre_stage_m;
		double m[6] = {1 - d.x * d.x, -d.x * d.y, -d.x * d.z,
			       1 - d.y * d.y, -d.y * d.z, 1 - d.z * d.z};

		for (int k = 0; k < 6; k++)
			a[k] += m[k];
		b = vec3_add(b, sym3_apply(m, c));
	}
	if (!sym3_invert(a, inv))
		return -EDOM;
	*out = sym3_apply(inv, b);
	return 0;
}

static void set_error(const struct sighting *s, struct equation *equation)
{
	equation->e[0] = s->pixel[0] - equation->q.pixel[0];
	equation->e[1] = s->pixel[1] - equation->q.pixel[1];
	equation->weight = 1 / (s->sigma_px * s->sigma_px);
}

/* Errors at p and, where `slopes`, their derivatives; without, those of the last time stay. */
static int linearise(const struct sighting *sightings, int count, struct vec3 p, bool slopes,
		     struct equation *equations)
{
	for (int i = 0; i < count; i++) {
		struct projection *q = &equations[i].q;

		if (!view_project(sightings[i].view, p, q->pixel, slopes ? q->slopes : NULL))
			return -EDOM;
		set_error(&sightings[i], &equations[i]);
	}
	return 0;
}

static void take_projections(const struct sighting *sightings, int count,
			     struct equation *equations)
{
	for (int i = 0; i < count; i++) {
		equations[i].q = sightings[i].at_guess;
		set_error(&sightings[i], &equations[i]);
	}
}

static void add_equation(const struct equation *q, double h[6], struct vec3 *g)
{
	for (int r = 0; r < 2; r++) {
		const double *j = q->q.slopes[r];
		double wx = q->weight * j[0], wy = q->weight * j[1], wz = q->weight * j[2];

		h[0] += wx * j[0];
		h[1] += wx * j[1];
		h[2] += wx * j[2];
		h[3] += wy * j[1];
		h[4] += wy * j[2];
		h[5] += wz * j[2];
		g->x += wx * q->e[r];
		g->y += wy * q->e[r];
		g->z += wz * q->e[r];
	}
}

/* Squared distance in the image that a step leaves of a view's error. */
static double left_px2(const struct equation *q, struct vec3 step)
{
	const double(*j)[3] = q->q.slopes;
	double x = q->e[0] - (j[0][0] * step.x + j[0][1] * step.y + j[0][2] * step.z);
	double y = q->e[1] - (j[1][0] * step.x + j[1][1] * step.y + j[1][2] * step.z);

	return x * x + y * y;
}

/* The step that the equations in `mask` ask for, and what is then known of the point. Leaves
 * p_stage_m alone. */
static int solve(const struct equation *equations, int count, uint32_t mask, struct fix *fix,
		 struct vec3 *step)
{
	double h[6] = {0}, chi2 = 0, distance2_px = 0;
	struct vec3 g = {0, 0, 0};
	int used = __builtin_popcount(mask);

	for (int i = 0; i < count; i++)
		if (mask >> i & 1)
			add_equation(&equations[i], h, &g);
	if (used < 2 || !sym3_invert(h, fix->cov_m2))
		return -EDOM;
	*step = sym3_apply(fix->cov_m2, g);
	for (int i = 0; i < count; i++) {
		if (!(mask >> i & 1))
			continue;
		double left = left_px2(&equations[i], *step);
		distance2_px += left;
		chi2 += equations[i].weight * left;
	}
	fix->residual_px = sqrt(distance2_px / used);
	fix->chi2_per_dof = chi2 / (2 * used - 3);
	fix->used_mask = mask;
	fix->used_count = used;
	return 0;
}

/* Steps until they are tiny; `projected` says that the first equations are made. `equations` and
 * `step` are those of the last one, so that the error of any view is at hand. */
static int converge(const struct sighting *sightings, int count, uint32_t mask, bool projected,
		    struct equation *equations, struct fix *fix, struct vec3 *step)
{
	bool slopes = true;

	for (int iteration = 0; iteration < ITERATION_MAX; iteration++) {
		int error = 0;

		if (iteration > 0 || !projected)
			error = linearise(sightings, count, fix->p_stage_m, slopes, equations);

		if (!error)
			error = solve(equations, count, mask, fix, step);
		if (error)
			return error;
		fix->p_stage_m = vec3_add(fix->p_stage_m, *step);
		double step_m = vec3_norm(*step);
		if (step_m < STEP_DONE_M)
			return 0;
		slopes = step_m > SLOPES_KEPT_M;
	}
	return -EDOM;
}

static bool has_suspect(const struct sighting *sightings, const struct equation *equations,
			int count, const struct fix *fix, struct vec3 step)
{
	/* three of the 2n coordinates are spent on the point: residuals are that much smaller */
	double share2 = 1.0 - 1.5 / fix->used_count;

	for (int i = 0; i < count; i++) {
		double sigma_px = sightings[i].sigma_px;
		double left = left_px2(&equations[i], step);

		if (fix->used_mask >> i & 1 && left > OUTLIER_MIN_PX * OUTLIER_MIN_PX * share2 &&
		    left > OUTLIER_SIGMA * OUTLIER_SIGMA * share2 * sigma_px * sigma_px)
			return true;
	}
	return false;
}

/* The best fix without one of its views, by chi2 per degree of freedom; the runner-up's value tells
 * how sure the choice is. */
static int leave_one_out(const struct equation *equations, int count, const struct fix *fix,
			 struct fix *best, double *runner_up)
{
	int found = -EDOM;

	*runner_up = INFINITY;
	for (int i = 0; i < count; i++) {
		struct fix without = *fix;
		struct vec3 step;

		if (!(fix->used_mask >> i & 1) ||
		    solve(equations, count, fix->used_mask & ~(1u << i), &without, &step))
			continue;
		if (found || without.chi2_per_dof < best->chi2_per_dof) {
			if (!found)
				*runner_up = best->chi2_per_dof;
			*best = without;
			found = 0;
		} else if (without.chi2_per_dof < *runner_up) {
			*runner_up = without.chi2_per_dof;
		}
	}
	return found;
}

static double chi2(const struct fix *fix)
{
	return fix->chi2_per_dof * (2 * fix->used_count - 3);
}

/* Without a good view chi2 falls by about two, seldom by ten. With three views every pair nearly
 * agrees: there it must also be plain which one is bad. */
static bool is_decisive(const struct fix *all, const struct fix *best, double runner_up)
{
	return chi2(all) - chi2(best) > OUTLIER_CHI2 &&
	       (all->used_count > 3 || best->chi2_per_dof * 9 < runner_up);
}

/* Views that disagree by more than their sigmas say that the sigmas are too small here. */
static void widen(struct fix *fix)
{
	for (int k = 0; k < 6 && fix->chi2_per_dof > WIDEN_CHI2; k++)
		fix->cov_m2[k] *= fix->chi2_per_dof;
}

int triangulate(const struct sighting *sightings, int count, const struct guess *guess,
		struct fix *out)
{
	struct equation equations[CAMERA_MAX];
	struct vec3 step;
	struct fix fix = {0};
	int error = 0;

	if (guess)
		fix.p_stage_m = guess->p_stage_m;
	if (guess && guess->projected)
		take_projections(sightings, count, equations);
	if (!guess)
		error = triangulate_rays(sightings, count, &fix.p_stage_m);
	if (!error)
		error = converge(sightings, count, count == 32 ? ~0u : (1u << count) - 1,
				 guess && guess->projected, equations, &fix, &step);
	while (!error && fix.used_count > 2 &&
	       has_suspect(sightings, equations, count, &fix, step)) {
		struct fix best = fix;
		double runner_up;

		if (leave_one_out(equations, count, &fix, &best, &runner_up) ||
		    !is_decisive(&fix, &best, runner_up))
			break;
		error = converge(sightings, count, best.used_mask, false, equations, &fix, &step);
	}
	if (error)
		return error;
	widen(&fix);
	*out = fix;
	return 0;
}
