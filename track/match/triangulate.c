/*
 * Weighted Gauss-Newton triangulation. Views that disagree are judged on the equations of the last
 * step: none is projected again for it.
 */
#include "track/match/triangulate.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "track/match/triangulate_parts.h"

#define ITERATION_MAX 8
/* After a step s the error left is about s^2 over the range: a quarter of a micrometre here. */
#define STEP_DONE_M 5e-4
#define SLOPES_KEPT_M 3e-3  /* after a shorter step they are as good as new */
#define SUSPECT_SPREADS 2.5 /* views disagree when chi2 is so much above its mean ... */
#define SUSPECT_MIN_PX 0.12 /* ... and one is farther off than what calibration leaves */
#define DOUBTS_MAX 4        /* each from where the last one led */
#define FEW_VIEWS 4
#define PLAIN_PX 0.2   /* the sigma of a spot that was not parted, at most */
#define WIDEN_CHI2 4.0 /* per degree of freedom; covariance follows the residuals beyond this */

/* Closest point to all rays (least squares in space): where Gauss-Newton starts. Returns -EDOM when
 * the rays are parallel. */
static int meet_rays(const struct sighting *sightings, int count, struct vec3 *out)
{
	double a[6] = {0}, inv[6], determinant;
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
	if (!sym3_invert(a, inv, &determinant))
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

/* The same at the guess, where the caller has made some of the projections. */
static int linearise_guess(const struct sighting *sightings, int count, struct vec3 p,
			   struct equation *equations)
{
	for (int i = 0; i < count; i++) {
		if (sightings[i].at_guess)
			equations[i].q = *sightings[i].at_guess;
		else if (!view_project(sightings[i].view, p, equations[i].q.pixel,
				       equations[i].q.slopes))
			return -EDOM;
		set_error(&sightings[i], &equations[i]);
	}
	return 0;
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

/* What is left of the errors of the views in `mask` after the step. */
static void measure(const struct equation *equations, int count, uint32_t mask, struct vec3 step,
		    struct fix *fix)
{
	double chi2 = 0, distance2_px = 0;
	int used = __builtin_popcount(mask);

	for (int i = 0; i < count; i++) {
		if (!(mask >> i & 1))
			continue;
		double left = equation_left_px2(&equations[i], step);
		distance2_px += left;
		chi2 += equations[i].weight * left;
	}
	fix->residual_px = sqrt(distance2_px / used);
	fix->chi2_per_dof = chi2 / (2 * used - 3);
	fix->used_mask = mask;
	fix->used_count = used;
}

/* The step that the equations ask for. */
static int solve(const struct equation *equations, int count, double cov_m2[6], struct vec3 *step)
{
	double h[6] = {0}, determinant;
	struct vec3 g = {0, 0, 0};

	for (int i = 0; i < count; i++)
		add_equation(&equations[i], h, &g);
	if (count < 2 || !sym3_invert(h, cov_m2, &determinant))
		return -EDOM;
	*step = sym3_apply(cov_m2, g);
	return 0;
}

/* Steps until they are tiny. `equations` and `step` are those of the last one, so that the error of
 * any view is at hand. */
static int converge(const struct sighting *sightings, int count, bool has_guess,
		    struct equation *equations, struct fix *fix, struct vec3 *step)
{
	bool slopes = true;

	for (int iteration = 0; iteration < ITERATION_MAX; iteration++) {
		int error =
			iteration == 0 && has_guess
				? linearise_guess(sightings, count, fix->p_stage_m, equations)
				: linearise(sightings, count, fix->p_stage_m, slopes, equations);

		if (!error)
			error = solve(equations, count, fix->cov_m2, step);
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

static bool views_disagree(const struct equation *equations, int count, const struct fix *fix,
			   struct vec3 step)
{
	double dof = 2 * count - 3, share2 = dof / (2 * count); /* the point takes up the rest */

	if (count < 3 || fix->chi2_per_dof * dof < dof + SUSPECT_SPREADS * sqrt(2 * dof))
		return false;
	for (int i = 0; i < count; i++)
		if (equation_left_px2(&equations[i], step) >
		    SUSPECT_MIN_PX * SUSPECT_MIN_PX * share2)
			return true;
	return false;
}

/* A spot that touches another may be both: where few views could contradict it, it is asked also
 * when none does. */
static bool may_be_misled(const struct sighting *sightings, int count)
{
	if (count < 3 || count > FEW_VIEWS)
		return false;
	for (int i = 0; i < count; i++)
		if (sightings[i].flags & BLOB_MERGED && sightings[i].sigma_px < PLAIN_PX)
			return true;
	return false;
}

/* The point by all readings of which views are bad, starting at the equations of the last step. */
static int doubt(const struct sighting *sightings, int count, struct equation *equations,
		 struct fix *fix, struct vec3 step)
{
	struct vec3 from_m = vec3_sub(fix->p_stage_m, step);
	struct doubt doubt;

	for (int i = 0;; i++) {
		int error = doubt_views(sightings, equations, count, &doubt);

		if (error)
			return error;
		fix->p_stage_m = vec3_add(from_m, doubt.step);
		if (vec3_norm(doubt.step) < STEP_DONE_M || i == DOUBTS_MAX)
			break;
		from_m = fix->p_stage_m;
		error = linearise(sightings, count, from_m, true, equations);
		if (error)
			return error;
	}
	memcpy(fix->cov_m2, doubt.cov_m2, sizeof(fix->cov_m2));
	measure(equations, count, fix->used_mask & ~doubt.bad_mask, doubt.step, fix);
	return 0;
}

/* Views that disagree by more than their sigmas say that the sigmas are too small here. */
static void widen(struct fix *fix)
{
	for (int k = 0; k < 6 && fix->chi2_per_dof > WIDEN_CHI2; k++)
		fix->cov_m2[k] *= fix->chi2_per_dof;
}

int triangulate(const struct sighting *sightings, int count, const struct vec3 *guess_stage_m,
		struct fix *out)
{
	struct equation equations[CAMERA_MAX];
	struct vec3 step;
	struct fix fix;
	int error = 0;

	if (guess_stage_m)
		fix.p_stage_m = *guess_stage_m;
	else
		error = meet_rays(sightings, count, &fix.p_stage_m);
	if (!error)
		error = converge(sightings, count, guess_stage_m != NULL, equations, &fix, &step);
	if (error)
		return error;
	measure(equations, count, count == 32 ? ~0u : (1u << count) - 1, step, &fix);
	if (!views_disagree(equations, count, &fix, step) && !may_be_misled(sightings, count))
		widen(&fix);
	else if ((error = doubt(sightings, count, equations, &fix, step)))
		return error;
	*out = fix;
	return 0;
}
