/*
 * Variance components of the residuals (Helmert): of all cameras by chi2 over its degrees of
 * freedom, of each by what a few points of every shot leave over in it.
 */
#include "track/excess.h"

#include <math.h>

#define GAIN 0.1        /* per shot */
#define CHI2_MAX 16.0   /* one point counts for no more */
#define MIXED_CHI2 9.0  /* of a point made of several markers' spots, ... */
#define MIXED_SHARE 0.1 /* ... of which there are no more than this */
#define DOF_MIN 10
#define MAX_PX2 (0.5 * 0.5)
/* Steps are shares of what is learned and this: were they shares of what a faint spot leaves over,
 * its noise alone would make the bright ones seem worse than they are. */
#define GRAIN_PX2 (0.005 * 0.005)

#define POINTS_A_SHOT 4
#define VIEWS_MIN 4       /* fewer do not tell which of them is off */
#define CAMERA_GAIN 0.024 /* per view */
#define STRAY_MAX 8.0     /* times what is expected: a stray view counts for no more ... */
#define OFF_RATIO 1.5     /* ... and a camera is off when its views leave over so much on average */

static void take_step(double *learned_px2, double share)
{
	*learned_px2 += share * (*learned_px2 + GRAIN_PX2);
	*learned_px2 = fmin(fmax(*learned_px2, 0), MAX_PX2);
}

/* Few points whose views contradict each other are mixes of markers and tell nothing of the rig;
 * where many do, it is the rig. */
static bool few_are_mixed(const struct matcher *m)
{
	uint32_t count = 0, mixed = 0;

	for (uint32_t p = 0; p < m->point_count; p++) {
		count += m->points[p].fix.used_count >= 3;
		mixed += m->points[p].fix.used_count >= 3 &&
			 m->points[p].fix.chi2_per_dof > MIXED_CHI2;
	}
	return mixed < MIXED_SHARE * count;
}

static void learn_all(struct tracker_state *state, const struct matcher *m)
{
	double most = few_are_mixed(m) ? MIXED_CHI2 : INFINITY, chi2 = 0, dof = 0;

	for (uint32_t p = 0; p < m->point_count; p++) {
		const struct fix *fix = &m->points[p].fix;
		double fix_dof = 2 * fix->used_count - 3;

		if (fix->used_count < 3 || fix->chi2_per_dof > most)
			continue;
		chi2 += fix_dof * fmin(fix->chi2_per_dof, CHI2_MAX);
		dof += fix_dof;
	}
	if (dof < DOF_MIN)
		return;
	take_step(&state->excess.all_px2, GAIN * (chi2 / dof - 1));
}

/* The spread that the point's own covariance makes in the image. */
static double spread_px2(const struct fix *fix, double slopes[2][3])
{
	double sum = 0;

	for (int row = 0; row < 2; row++) {
		const double *j = slopes[row], *c = fix->cov_m2;

		sum += j[0] * j[0] * c[0] + j[1] * j[1] * c[3] + j[2] * j[2] * c[5] +
		       2 * (j[0] * j[1] * c[1] + j[0] * j[2] * c[2] + j[1] * j[2] * c[4]);
	}
	return sum;
}

/* A view that the point was made from takes it some way along; one that it was not, does not. */
static void learn_view(struct tracker_state *state, const struct matcher *m,
		       const struct point *point, uint32_t c)
{
	const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];
	double pixel[2], slopes[2][3], sigma_px = match_sigma_px(m, c, blob);

	if (blob->flags || !view_project(m->cameras[c].view, point->fix.p_stage_m, pixel, slopes))
		return;
	double own_px2 = 2 * sigma_px * sigma_px, taken_px2 = spread_px2(&point->fix, slopes);
	double expected_px2 = fmax(
		own_px2 + (point->fix.used_mask >> c & 1 ? -taken_px2 : taken_px2), 0.3 * own_px2);
	double x_px = blob->x_px - pixel[0], y_px = blob->y_px - pixel[1];
	double left_px2 = fmin(x_px * x_px + y_px * y_px, STRAY_MAX * expected_px2);

	take_step(&state->excess.camera_px2[c],
		  CAMERA_GAIN * (left_px2 / expected_px2 - OFF_RATIO));
}

static void learn_cameras(struct tracker_state *state, const struct matcher *m)
{
	for (uint32_t k = 0; k < POINTS_A_SHOT && k < m->point_count; k++) {
		const struct point *point = &m->points[state->excess_turn++ % m->point_count];

		if (point->fix.used_count < VIEWS_MIN)
			continue;
		for (uint32_t left = point->claimed_mask; left; left &= left - 1)
			learn_view(state, m, point, (uint32_t)__builtin_ctz(left));
	}
}

void excess_learn(struct tracker_state *state, const struct matcher *m)
{
	learn_all(state, m);
	learn_cameras(state, m);
}
