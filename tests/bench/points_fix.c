/*
 * Triangulation as the tracker calls it, from a guess a millimetre off, on random rigs. Errors are
 * held against the Cramer-Rao bound of the true lenses, trial by trial, so that every geometry
 * weighs alike; with views that lie, against an oracle who knows which (a linear solution from the
 * good ones alone).
 */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "tests/bench/points.h"
#include "tests/bench/points_rig.h"
#include "track/match/triangulate.h"

#define COUNT_MAX 8
#define RIGS_PER_COUNT 3 /* times the effort */
#define POINTS_PER_RIG 1000
#define BALL_M 0.15
#define GUESS_OFF_M 0.001
#define CHI2_95 7.815 /* three degrees of freedom */

enum noise { NOISE_EQUAL, NOISE_UNEQUAL, NOISE_LIARS };

#define LIAR_SIGMA_PX 0.1
#define LIAR_OFF_PX 1.0
#define LIAR_SHARE 0.05

struct tally {
	double error2, reference2; /* over the bound's square, summed */
	double nees;
	int inside_95, count, refused;
};

struct trial {
	struct vec3 p;
	int count;
	struct sighting sightings[COUNT_MAX];
	double slopes[COUNT_MAX][2][3]; /* the truth's */
	double noise_px[COUNT_MAX][2];
	uint32_t liars;
};

static double det3(const double a[6])
{
	return a[0] * (a[3] * a[5] - a[4] * a[4]) - a[1] * (a[1] * a[5] - a[4] * a[2]) +
	       a[2] * (a[1] * a[4] - a[3] * a[2]);
}

/* Symmetric 3x3 as xx xy xz yy yz zz. */
static void invert(const double a[6], double inv[6])
{
	double d = det3(a);

	inv[0] = (a[3] * a[5] - a[4] * a[4]) / d;
	inv[1] = (a[2] * a[4] - a[1] * a[5]) / d;
	inv[2] = (a[1] * a[4] - a[2] * a[3]) / d;
	inv[3] = (a[0] * a[5] - a[2] * a[2]) / d;
	inv[4] = (a[1] * a[2] - a[0] * a[4]) / d;
	inv[5] = (a[0] * a[3] - a[1] * a[1]) / d;
}

static struct vec3 apply(const double a[6], struct vec3 v)
{
	return (struct vec3){a[0] * v.x + a[1] * v.y + a[2] * v.z,
			     a[1] * v.x + a[3] * v.y + a[4] * v.z,
			     a[2] * v.x + a[4] * v.y + a[5] * v.z};
}

static double squared_sigmas(struct vec3 e, const double cov[6])
{
	double inverse[6];

	invert(cov, inverse);
	return vec3_dot(e, apply(inverse, e));
}

/* The bound on the covariance from the views in `mask`, and the error of the best linear estimate
 * from them. */
static void best_from(const struct trial *trial, uint32_t mask, double cov[6], struct vec3 *error)
{
	double h[6] = {0};
	struct vec3 g = {0, 0, 0};

	for (int c = 0; c < trial->count; c++)
		for (int i = 0; i < 2 && (mask >> c & 1); i++) {
			const double *j = trial->slopes[c][i];
			double w =
				1 / (trial->sightings[c].sigma_px * trial->sightings[c].sigma_px);
			double e = w * trial->noise_px[c][i];

			h[0] += w * j[0] * j[0];
			h[1] += w * j[0] * j[1];
			h[2] += w * j[0] * j[2];
			h[3] += w * j[1] * j[1];
			h[4] += w * j[1] * j[2];
			h[5] += w * j[2] * j[2];
			g = vec3_add(g, (struct vec3){e * j[0], e * j[1], e * j[2]});
		}
	invert(h, cov);
	*error = apply(cov, g);
}

static double random_sigma_px(struct rng *rng, enum noise noise)
{
	if (noise == NOISE_UNEQUAL) /* of one point, up to 1:10 */
		return 0.02 * pow(10, rng_uniform(rng));
	return noise == NOISE_EQUAL ? 0.05 : LIAR_SIGMA_PX;
}

static void look(struct trial *trial, int c, struct rng *rng, enum noise noise)
{
	struct sighting *s = &trial->sightings[c];
	double turn_rad = 2 * M_PI * rng_uniform(rng);
	bool lies = noise == NOISE_LIARS && rng_uniform(rng) < LIAR_SHARE;

	s->sigma_px = random_sigma_px(rng, noise);
	trial->liars |= lies ? 1u << c : 0;
	for (int i = 0; i < 2; i++) {
		trial->noise_px[c][i] = s->sigma_px * rng_normal(rng);
		s->pixel[i] += trial->noise_px[c][i] +
			       (lies ? LIAR_OFF_PX * (i ? sin(turn_rad) : cos(turn_rad)) : 0);
	}
}

static bool in_picture(const double pixel[2])
{
	return pixel[0] > 0 && pixel[0] < RIG_WIDTH_PX - 1 && pixel[1] > 0 &&
	       pixel[1] < RIG_HEIGHT_PX - 1;
}

/* A point that all cameras of the rig see. */
static void draw_trial(struct trial *trial, const struct random_rig *rig, struct rng *rng,
		       enum noise noise)
{
	bool seen = false;

	memset(trial, 0, sizeof(*trial));
	trial->count = (int)rig->count;
	while (!seen) {
		trial->p = random_in_ball(rng, BALL_M);
		seen = true;
		for (int c = 0; c < trial->count; c++) {
			rig_camera_project(&rig->cameras[c], trial->p, trial->sightings[c].pixel);
			seen &= in_picture(trial->sightings[c].pixel);
		}
	}
	for (int c = 0; c < trial->count; c++) {
		trial->sightings[c].view = &rig->views[c];
		rig_camera_slopes(&rig->cameras[c], trial->p, trial->slopes[c]);
		look(trial, c, rng, noise);
	}
}

static int fix_as_tracker(struct trial *trial, struct rng *rng, struct fix *fix)
{
	struct vec3 off = random_in_ball(rng, GUESS_OFF_M);
	struct vec3 guess = vec3_add(trial->p, off);
	struct projection at_guess[COUNT_MAX];

	for (int c = 0; c < trial->count; c++) {
		struct sighting *s = &trial->sightings[c];
		struct projection *q = &at_guess[c];

		s->at_guess = view_project(s->view, guess, q->pixel, q->slopes) ? q : NULL;
	}
	return triangulate(trial->sightings, trial->count, &guess, fix);
}

static void add_trial(struct tally *tally, const struct random_rig *rig, struct rng *rng,
		      enum noise noise)
{
	struct trial trial;
	struct vec3 best_error, oracle_error;
	double bound[6], oracle_bound[6];
	struct fix fix;

	draw_trial(&trial, rig, rng, noise);
	uint32_t good = ((1u << trial.count) - 1) & ~trial.liars;
	if (__builtin_popcount(good) < 2) /* not even the oracle knows */
		return;
	best_from(&trial, (1u << trial.count) - 1, bound, &best_error);
	best_from(&trial, good, oracle_bound, &oracle_error);
	if (fix_as_tracker(&trial, rng, &fix)) {
		tally->refused++;
		return;
	}
	struct vec3 error = vec3_sub(fix.p_stage_m, trial.p);
	double nees = squared_sigmas(error, fix.cov_m2), scale = bound[0] + bound[3] + bound[5];

	tally->error2 += vec3_dot(error, error) / scale;
	tally->reference2 +=
		noise == NOISE_LIARS ? vec3_dot(oracle_error, oracle_error) / scale : 1;
	tally->nees += nees / 3;
	tally->inside_95 += nees < CHI2_95;
	tally->count++;
}

/* By number of views. */
static void run(struct points_bench *bench, enum noise noise, int least, int most,
		struct tally tallies[COUNT_MAX + 1])
{
	struct rng rng;

	rng_init(&rng, bench->seed, (uint64_t)noise);
	memset(tallies, 0, (COUNT_MAX + 1) * sizeof(*tallies));
	for (int count = least; count <= most; count++)
		for (int r = 0; r < RIGS_PER_COUNT * bench->effort; r++) {
			static struct random_rig rig;

			random_rig_init(&rig, &rng, (uint32_t)count, BALL_M);
			for (int k = 0; k < POINTS_PER_RIG; k++)
				add_trial(&tallies[count], &rig, &rng, noise);
			random_rig_finish(&rig);
		}
}

static double ratio(const struct tally *tally)
{
	return sqrt(tally->error2 / tally->reference2);
}

static void tell_ratio(struct points_bench *bench, const char *name, const char *by_views,
		       const struct tally tallies[COUNT_MAX + 1])
{
	json_t *parts = json_object();
	struct tally sum = {0};
	char views[8];

	for (int n = 2; n <= COUNT_MAX; n++) {
		sum.error2 += tallies[n].error2;
		sum.reference2 += tallies[n].reference2;
		snprintf(views, sizeof(views), "%d", n);
		if (tallies[n].count)
			json_object_set_new(parts, views, json_real(ratio(&tallies[n])));
	}
	json_object_set_new(bench->figures, name, json_real(ratio(&sum)));
	json_object_set_new(bench->figures, by_views, parts);
}

static void tell_covariances(struct points_bench *bench, const char *const names[4],
			     const struct tally *tallies)
{
	double least[2] = {INFINITY, INFINITY}, most[2] = {0, 0};

	for (int n = 2; n <= COUNT_MAX; n++) {
		double values[2] = {tallies[n].nees / tallies[n].count,
				    (double)tallies[n].inside_95 / tallies[n].count};

		for (int k = 0; k < 2 && tallies[n].count; k++) {
			least[k] = fmin(least[k], values[k]);
			most[k] = fmax(most[k], values[k]);
		}
	}
	for (int k = 0; k < 4; k++)
		json_object_set_new(bench->figures, names[k],
				    json_real(k % 2 ? most[k / 2] : least[k / 2]));
}

static void count_refused(const struct tally *tallies, int *refused)
{
	for (int n = 2; n <= COUNT_MAX; n++)
		*refused += tallies[n].refused;
}

void bench_fixes(struct points_bench *bench)
{
	static const char *const names[3][2] = {
		{"point_rmse_over_crlb", "point_rmse_over_crlb_by_views"},
		{"point_rmse_over_crlb_unequal", "point_rmse_over_crlb_unequal_by_views"},
		{"point_rmse_over_oracle_outliers", "point_rmse_over_oracle_outliers_by_views"},
	};
	static const char *const covariance_names[3][4] = {
		{"nees_over_3_least", "nees_over_3_most", "ellipsoid_95_share_least",
		 "ellipsoid_95_share_most"},
		{"nees_over_3_unequal_least", "nees_over_3_unequal_most",
		 "ellipsoid_95_share_unequal_least", "ellipsoid_95_share_unequal_most"},
		{"nees_over_3_outliers_least", "nees_over_3_outliers_most",
		 "ellipsoid_95_share_outliers_least", "ellipsoid_95_share_outliers_most"},
	};
	struct tally tallies[COUNT_MAX + 1];
	int refused = 0;

	for (int noise = NOISE_EQUAL; noise <= NOISE_LIARS; noise++) {
		bool liars = noise == NOISE_LIARS;

		run(bench, (enum noise)noise, liars ? 3 : 2, liars ? 5 : COUNT_MAX, tallies);
		tell_ratio(bench, names[noise][0], names[noise][1], tallies);
		tell_covariances(bench, covariance_names[noise], tallies);
		count_refused(tallies, &refused);
	}
	json_object_set_new(bench->figures, "points_refused", json_integer(refused));
}
