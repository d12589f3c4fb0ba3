/*
 * Weighted Gauss-Newton triangulation, and the search for a view that does not belong.
 */
#include "track/triangulate.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>

#define ITERATION_MAX 6
#define STEP_DONE_M 1e-8
#define OUTLIER_SIGMA 3.5   /* a view this far off, in its own sigmas, is suspected ... */
#define OUTLIER_CHI2 22.0   /* what dropping it must take off: two degrees of freedom, p = 2e-5 */
#define WIDEN_CHI2 4.0      /* ... covariance follows the residuals beyond this */
#define OUTLIER_MIN_PX 0.12 /* ... unless it is within what calibration leaves */

/* Symmetric 3x3 as xx xy xz yy yz zz. */
static bool sym3_invert(const double a[6], double inv[6])
{
	double c0 = a[3] * a[5] - a[4] * a[4];
	double c1 = a[2] * a[4] - a[1] * a[5];
	double c2 = a[1] * a[4] - a[2] * a[3];
	double det = a[0] * c0 + a[1] * c1 + a[2] * c2;

	if (!(fabs(det) > 1e-12 * fabs(a[0] * a[3] * a[5])))
		return false;
	inv[0] = c0 / det;
	inv[1] = c1 / det;
	inv[2] = c2 / det;
	inv[3] = (a[0] * a[5] - a[2] * a[2]) / det;
	inv[4] = (a[1] * a[2] - a[0] * a[4]) / det;
	inv[5] = (a[0] * a[3] - a[1] * a[1]) / det;
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

/* Normal equations of one view at p; returns its squared error in sigmas, or -1 when p is out of
 * its sight. */
static double add_view(const struct sighting *s, struct vec3 p, double h[6], struct vec3 *g,
		       double *distance2_px)
{
	double q[2], j[2][3];

	if (!view_project(s->view, p, q, j))
		return -1;
	double w = 1.0 / (s->sigma_px * s->sigma_px);
	double e[2] = {s->pixel[0] - q[0], s->pixel[1] - q[1]};

	for (int r = 0; r < 2; r++) {
		h[0] += w * j[r][0] * j[r][0];
		h[1] += w * j[r][0] * j[r][1];
		h[2] += w * j[r][0] * j[r][2];
		h[3] += w * j[r][1] * j[r][1];
		h[4] += w * j[r][1] * j[r][2];
		h[5] += w * j[r][2] * j[r][2];
		g->x += w * j[r][0] * e[r];
		g->y += w * j[r][1] * e[r];
		g->z += w * j[r][2] * e[r];
	}
	*distance2_px = e[0] * e[0] + e[1] * e[1];
	return w * *distance2_px;
}

/* Solves over the views in `mask`, from fix->p_stage_m on. */
static int solve_views(const struct sighting *sightings, int count, uint32_t mask, struct fix *fix)
{
	struct vec3 p = fix->p_stage_m;

	for (int iteration = 0; iteration < ITERATION_MAX; iteration++) {
		double h[6] = {0}, cov[6], chi2 = 0, distance2_px = 0;
		struct vec3 g = {0, 0, 0};
		int used = 0;

		for (int i = 0; i < count; i++) {
			double view_distance2_px;

			if (!(mask & (1u << i)))
				continue;
			double view_chi2 = add_view(&sightings[i], p, h, &g, &view_distance2_px);
			if (view_chi2 < 0)
				return -EDOM;
			chi2 += view_chi2;
			distance2_px += view_distance2_px;
			used++;
		}
		if (used < 2 || !sym3_invert(h, cov))
			return -EDOM;
		struct vec3 step = sym3_apply(cov, g);
		/* The error before the last, tiny step is the error: no further projection. */
		p = vec3_add(p, step);
		if (vec3_norm(step) < STEP_DONE_M || iteration == ITERATION_MAX - 1) {
			fix->p_stage_m = p;
			for (int k = 0; k < 6; k++)
				fix->cov_m2[k] = cov[k];
			fix->residual_px = sqrt(distance2_px / used);
			fix->chi2_per_dof = chi2 / (2 * used - 3);
			fix->used_mask = mask;
			fix->used_count = used;
			return 0;
		}
	}
	return -EDOM;
}

static bool has_suspect(const struct sighting *sightings, int count, const struct fix *fix)
{
	for (int i = 0; i < count; i++) {
		double q[2];

		if (!(fix->used_mask & (1u << i)))
			continue;
		if (!view_project(sightings[i].view, fix->p_stage_m, q, NULL))
			return true;
		double error_px = hypot(sightings[i].pixel[0] - q[0], sightings[i].pixel[1] - q[1]);
		/* the others are pulled along: among few views an outlier shows only part of itself
		 */
		double share = 1.0 - 1.5 / fix->used_count;
		if (error_px > OUTLIER_MIN_PX * share &&
		    error_px > OUTLIER_SIGMA * share * sightings[i].sigma_px)
			return true;
	}
	return false;
}

/* The best fix without one of its views, by chi2 per degree of freedom; the runner-up's value tells
 * how sure the choice is. */
static int leave_one_out(const struct sighting *sightings, int count, const struct fix *fix,
			 struct fix *best, double *runner_up)
{
	int found = -EDOM;

	*runner_up = INFINITY;
	for (int i = 0; i < count; i++) {
		struct fix without = *fix;

		if (!(fix->used_mask & (1u << i)) ||
		    solve_views(sightings, count, fix->used_mask & ~(1u << i), &without))
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

int triangulate(const struct sighting *sightings, int count, struct fix *out)
{
	struct fix fix;
	int error = triangulate_rays(sightings, count, &fix.p_stage_m);

	if (error)
		return error;
	error = solve_views(sightings, count, count == 32 ? ~0u : (1u << count) - 1, &fix);
	if (error)
		return error;
	while (fix.used_count > 2 && has_suspect(sightings, count, &fix)) {
		struct fix best;
		double runner_up;

		if (leave_one_out(sightings, count, &fix, &best, &runner_up))
			break;
		if (!is_decisive(&fix, &best, runner_up))
			break;
		fix = best;
	}
	widen(&fix);
	*out = fix;
	return 0;
}
