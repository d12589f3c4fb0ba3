/*
 * Variance components of the residuals (Helmert): of all cameras, and of each, by what some points
 * of every shot leave over in their views.
 */
#include "track/excess.h"

#include <math.h>

#define GAIN 0.1        /* per shot */
#define CHI2_MAX 16.0   /* one view counts for no more */
#define MIXED_CHI2 9.0  /* of a point made of several markers' spots, ... */
#define MIXED_SHARE 0.1 /* ... of which there are no more than this */
#define VIEWS_TELL 5    /* of a shot, at least */
#define MAX_PX2 (0.5 * 0.5)
/* Steps are shares of what is learned and this: were they shares of what a faint spot leaves over,
 * its noise alone would make the bright ones seem worse than they are. */
#define GRAIN_PX2 (0.005 * 0.005)

#define POINTS_A_SHOT 8
#define VIEWS_MIN 4       /* fewer do not tell which of them is off */
#define CAMERA_GAIN 0.012 /* per view */
#define STRAY_MAX 8.0     /* times what is expected: a stray view counts for no more ... */
#define OFF_RATIO 1.5     /* ... and a camera is off when its views leave over so much on average */

/* Squared distance of a view from its point. */
struct leftover {
	double own_px2; /* by the spot's sigma alone */
	double expected_px2, is_px2;
};

/* Sums over views, each with the weight that its exactness gives it. */
struct tally {
	int views;
	double over, expected;
};

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

/* A view that the point was made from takes it some way along; one that it was not, does not.
 */
static bool look_at(const struct matcher *m, const struct point *point, uint32_t c,
		    const struct blob *blob, struct leftover *out)
{
	double pixel[2], slopes[2][3], sigma_px = match_sigma_px(m, c, blob);

	if (blob->flags & (BLOB_MERGED | BLOB_EDGE) ||
	    !view_project(m->cameras[c].view, point->fix.p_stage_m, pixel, slopes))
		return false;
	double own_px2 = 2 * sigma_px * sigma_px, taken_px2 = spread_px2(&point->fix, slopes);
	double x_px = blob->x_px - pixel[0], y_px = blob->y_px - pixel[1];

	out->own_px2 = own_px2;
	out->expected_px2 = fmax(own_px2 + (point->fix.used_mask >> c & 1 ? -taken_px2 : taken_px2),
				 0.3 * own_px2);
	out->is_px2 = x_px * x_px + y_px * y_px;
	return true;
}

/* An excess shows in the exact views; many vague ones, whose sigmas are rather too wide, would
 * outvote them. So they weigh as maximum likelihood has it, by the inverse square of what they are
 * off by anyway. */
static void count_view(struct tally *tally, const struct leftover *left)
{
	double weight = 1 / (left->own_px2 * left->own_px2);

	tally->views++;
	tally->over +=
		weight * (fmin(left->is_px2, CHI2_MAX * left->expected_px2) - left->expected_px2);
	tally->expected += weight * left->expected_px2;
}

static void learn_camera(double *learned_px2, const struct leftover *left)
{
	double ratio = fmin(left->is_px2 / left->expected_px2, STRAY_MAX);

	take_step(learned_px2, CAMERA_GAIN * (ratio - OFF_RATIO));
}

static void learn_point(struct tracker_state *state, const struct matcher *m,
			const struct point *point, double chi2_most, struct tally *tally)
{
	bool tells = point->fix.used_count >= 3 && point->fix.chi2_per_dof <= chi2_most;

	for (uint32_t views = point->claimed_mask; views; views &= views - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(views);
		const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];
		struct leftover left;

		if (!look_at(m, point, c, blob, &left))
			continue;
		if (tells && point->fix.used_mask >> c & 1)
			count_view(tally, &left);
		if (point->fix.used_count >= VIEWS_MIN && !blob->flags)
			learn_camera(&state->excess.camera_px2[c], &left);
	}
}

void excess_learn(struct tracker_state *state, const struct matcher *m)
{
	double chi2_most = few_are_mixed(m) ? MIXED_CHI2 : INFINITY;
	struct tally tally = {0};

	for (uint32_t k = 0; k < POINTS_A_SHOT && k < m->point_count; k++)
		learn_point(state, m, &m->points[state->excess_turn++ % m->point_count], chi2_most,
			    &tally);
	if (tally.views >= VIEWS_TELL)
		take_step(&state->excess.all_px2, GAIN * tally.over / tally.expected);
}
