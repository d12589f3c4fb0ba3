/*
 * Which views lie, and where the point then is: every reading ("these views are bad, the others
 * good") is solved and weighed by its probability, and the answer is the mean over the readings,
 * its covariance with their spread. (Bayesian model averaging: Hoeting et al. 1999; the mixture of
 * good and bad measurements: Box and Tiao 1968.) With three to five views it is often not plain
 * which one is bad, and the mean is then the least wrong.
 */
#include <errno.h>
#include <math.h>
#include <stddef.h>

#include "track/match/triangulate_parts.h"

#define SUSPECT_MAX 6 /* views that may be bad at once are among these ... */
#define BAD_MAX 3     /* ... and at most so many */
/* The last ones: one view is poor, and boasting. */
#define READING_MAX ((1 << SUSPECT_MAX) + SUSPECT_MAX + 1)

/* Of a bad view, per axis. It is a blob near enough to be chosen, so a pixel off, hardly more; what
 * is farther off says so itself. */
#define BAD_SIGMA_PX 1.0

#define DELETED_MIN 1e-6 /* of a view's own variance: what the others leave of it */

/* How often a view is bad, by what the blob finder says of the blob. */
#define BAD_SHARE 0.03
#define BAD_SHARE_SATURATED 0.06
#define BAD_SHARE_EDGE 0.2
#define BAD_SHARE_MERGED 0.3
/* ... or was in the last shot: half of its disc is hidden still, or a light in its spot */
#define BAD_SHARE_AGAIN 0.3

/* One that is neither good nor bad: a fixed pattern or a reflection in its spot. */
#define POOR_SPREADS 3.0
#define POOR_SHARE 0.015

/* How often all sigmas of a point are too small by the same factor. */
#define BOAST_SHARE 1e-3

/* Sums of weighted equations: normal matrix, right side, and the squared errors. */
struct sums {
	double h[6];
	struct vec3 g;
	double e2;
};

/* What a view is if it is not good. */
struct fault {
	double lost;     /* share of its weight that it loses then */
	double log_odds; /* of it, and of the height of its density then, over being good */
};

struct suspect {
	int view;
	double off;       /* squared sigmas from where the point is wanted */
	struct sums sums; /* its equations */
	struct fault bad, poor;
};

/* What the views add up to when some of them are not good. */
struct belief {
	struct sums sums;
	double log_odds;
	uint32_t bad_mask;
};

struct reading {
	uint32_t bad_mask;
	struct vec3 step;
	double cov_m2[6];
	double log_weight; /* up to a constant */
	double share;      /* its probability */
};

struct readings {
	int suspect_count;
	struct suspect suspects[SUSPECT_MAX]; /* the worst first */
	int count;
	struct reading list[READING_MAX];
};

static void sums_add(struct sums *sums, const struct sums *more, double scale)
{
	sym3_add(sums->h, more->h, scale);
	sums->g = vec3_add(sums->g, vec3_scale(more->g, scale));
	sums->e2 += scale * more->e2;
}

static struct sums sums_of(const struct equation *q)
{
	struct sums s = {.e2 = q->weight * (q->e[0] * q->e[0] + q->e[1] * q->e[1])};

	for (int i = 0; i < 2; i++) {
		const double *j = q->q.slopes[i];
		double products[6] = {j[0] * j[0], j[0] * j[1], j[0] * j[2],
				      j[1] * j[1], j[1] * j[2], j[2] * j[2]};

		sym3_add(s.h, products, q->weight);
		s.g = vec3_add(s.g, vec3_scale(slope_of(&q->q, i), q->weight * q->e[i]));
	}
	return s;
}

static double bad_share(const struct sighting *sighting)
{
	return sighting->flags & BLOB_MERGED      ? BAD_SHARE_MERGED
	       : sighting->was_outvoted           ? BAD_SHARE_AGAIN
	       : sighting->flags & BLOB_EDGE      ? BAD_SHARE_EDGE
	       : sighting->flags & BLOB_SATURATED ? BAD_SHARE_SATURATED
						  : BAD_SHARE;
}

/* Of a share of the views whose variance is so many times that of a good one. */
static struct fault fault_of(double share, double times)
{
	return (struct fault){1 - 1 / times, log(share / (1 - share) / times)};
}

/* By how many squared sigmas a view is off where the others want the point: one that lies and
 * boasts has the point where it wants it, and is found by this alone (deleted residuals; Cook and
 * Weisberg 1982). */
static double contradiction(const struct equation *q, const struct reading *all)
{
	struct vec3 jx = slope_of(&q->q, 0), jy = slope_of(&q->q, 1);
	struct vec3 cx = sym3_apply(all->cov_m2, jx), cy = sym3_apply(all->cov_m2, jy);
	double x = q->e[0] - vec3_dot(jx, all->step), y = q->e[1] - vec3_dot(jy, all->step);
	double own = 1 / q->weight, xx = own - vec3_dot(jx, cx), yy = own - vec3_dot(jy, cy);
	double xy = -vec3_dot(jx, cy), determinant = xx * yy - xy * xy;

	if (!(determinant > DELETED_MIN * own * own)) /* without it there is no point */
		return q->weight * (x * x + y * y);
	return (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant;
}

static struct suspect suspect_of(int view, const struct sighting *sighting,
				 const struct equation *equation, const struct sums *sums,
				 const struct reading *from, bool deleted)
{
	double left_px2 = equation_left_px2(equation, from->step);
	double bad_px2 = fmax(BAD_SIGMA_PX * BAD_SIGMA_PX, 0.5 * left_px2);

	return (struct suspect){
		.view = view,
		.off = deleted ? contradiction(equation, from) : equation->weight * left_px2,
		.sums = *sums,
		.bad = fault_of(bad_share(sighting), 1 + bad_px2 * equation->weight),
		.poor = fault_of(POOR_SHARE, POOR_SPREADS * POOR_SPREADS)};
}

/* Keeps the list sorted, the worst first; the least bad one falls off when it is full. */
static void add_suspect(struct readings *r, const struct suspect *suspect)
{
	int place = r->suspect_count;

	while (place > 0 && r->suspects[place - 1].off < suspect->off)
		place--;
	if (place == SUSPECT_MAX)
		return;
	r->suspect_count += r->suspect_count < SUSPECT_MAX;
	for (int k = r->suspect_count - 1; k > place; k--)
		r->suspects[k] = r->suspects[k - 1];
	r->suspects[place] = *suspect;
}

/* The same with a fault more. */
static void with_fault(const struct belief *belief, const struct suspect *suspect,
		       const struct fault *fault, struct belief *out)
{
	const struct sums *a = &belief->sums, *b = &suspect->sums;

	for (int k = 0; k < 6; k++)
		out->sums.h[k] = a->h[k] + -fault->lost * b->h[k];
	out->sums.g = vec3_add(a->g, vec3_scale(b->g, -fault->lost));
	out->sums.e2 = a->e2 + -fault->lost * b->e2;
	out->log_odds = belief->log_odds + fault->log_odds;
	out->bad_mask = belief->bad_mask;
}

/* Solves what the views add up to; the reading's weight is the marginal likelihood. */
static void add_reading(struct readings *r, const struct belief *belief)
{
	struct reading *reading = &r->list[r->count];
	double determinant;

	if (!sym3_invert(belief->sums.h, reading->cov_m2, &determinant) || !(determinant > 0))
		return;
	reading->bad_mask = belief->bad_mask;
	reading->step = sym3_apply(reading->cov_m2, belief->sums.g);
	double chi2 = belief->sums.e2 - vec3_dot(belief->sums.g, reading->step);
	reading->log_weight = belief->log_odds - 0.5 * (log(determinant) + chi2);
	r->count++;
}

/* Every set of at most BAD_MAX suspects is bad, each set by one more than a set before it. */
static void add_bad(struct readings *r, const struct belief *all_good)
{
	struct belief beliefs[1 << SUSPECT_MAX];

	beliefs[0] = *all_good;
	for (uint32_t set = 1; set < 1u << r->suspect_count; set++) {
		int last = 31 - __builtin_clz(set);
		const struct suspect *suspect = &r->suspects[last];

		if (__builtin_popcount(set) > BAD_MAX)
			continue;
		with_fault(&beliefs[set ^ 1u << last], suspect, &suspect->bad, &beliefs[set]);
		beliefs[set].bad_mask |= 1u << suspect->view;
		add_reading(r, &beliefs[set]);
	}
}

/* One view is poor, the others are good: it is used, with a wider sigma. */
static void add_poor(struct readings *r, const struct belief *all_good,
		     const struct suspect *suspect)
{
	struct belief belief;

	with_fault(all_good, suspect, &suspect->poor, &belief);
	add_reading(r, &belief);
}

/* All views are good and all their sigmas are too small: by the factor that explains the errors. */
static void add_boast(struct readings *r, const struct sums *all_good, int view_count)
{
	double all_chi2 = all_good->e2 - vec3_dot(all_good->g, r->list[0].step);
	double dof = 2 * view_count - 3, factor2 = all_chi2 / dof;
	struct reading *reading = &r->list[r->count];

	if (factor2 <= 1)
		return;
	*reading = r->list[0];
	reading->log_weight += log(BOAST_SHARE) + 0.5 * (all_chi2 - dof * (log(factor2) + 1));
	for (int k = 0; k < 6; k++)
		reading->cov_m2[k] *= factor2;
	r->count++;
}

/* Shares that sum to one. */
static void normalise(struct readings *r)
{
	double most = -INFINITY, sum = 0;

	for (int k = 0; k < r->count; k++)
		most = fmax(most, r->list[k].log_weight);
	for (int k = 0; k < r->count; k++) {
		double log_share = r->list[k].log_weight - most;

		r->list[k].share = log_share > -30 ? exp(log_share) : 0;
		sum += r->list[k].share;
	}
	for (int k = 0; k < r->count; k++)
		r->list[k].share /= sum;
}

static void average(const struct readings *r, struct doubt *out)
{
	double bad[CAMERA_MAX] = {0};

	*out = (struct doubt){0};
	for (int k = 0; k < r->count; k++)
		out->step = vec3_add(out->step, vec3_scale(r->list[k].step, r->list[k].share));
	for (int k = 0; k < r->count; k++) {
		const struct reading *reading = &r->list[k];
		struct vec3 d = vec3_sub(reading->step, out->step);
		double spread[6] = {d.x * d.x, d.x * d.y, d.x * d.z,
				    d.y * d.y, d.y * d.z, d.z * d.z};

		sym3_add(out->cov_m2, reading->cov_m2, reading->share);
		sym3_add(out->cov_m2, spread, reading->share);
		for (uint32_t left = reading->bad_mask; left; left &= left - 1)
			bad[__builtin_ctz(left)] += reading->share;
	}
	for (int c = 0; c < CAMERA_MAX; c++)
		if (bad[c] > 0.5)
			out->bad_mask |= 1u << c;
}

/* Halves of merged spots are off together, where two lips were parted wrongly: they do not outvote
 * a plain view. */
static bool most_are_parts(const struct sighting *sightings, int count)
{
	int parts = 0;

	for (int i = 0; i < count; i++)
		parts += (sightings[i].flags & BLOB_MERGED) != 0;
	return 2 * parts > count;
}

/* Besides the first reading, all those of whom the views put in doubt that want the point where
 * `from` has it; `deleted`: of whom all but the one put in doubt. */
static void doubt_from(struct readings *r, const struct sighting *sightings,
		       const struct equation *equations, const struct sums *sums, int count,
		       const struct belief *all_good, const struct reading *from, bool deleted)
{
	r->suspect_count = 0;
	r->count = 1;
	for (int i = 0; i < count; i++) {
		struct suspect suspect =
			suspect_of(i, &sightings[i], &equations[i], &sums[i], from, deleted);

		add_suspect(r, &suspect);
	}
	add_bad(r, all_good);
}

static const struct reading *best_reading(const struct readings *r)
{
	const struct reading *best = &r->list[0];

	for (int k = 1; k < r->count; k++)
		if (r->list[k].log_weight > best->log_weight)
			best = &r->list[k];
	return best;
}

int doubt_views(const struct sighting *sightings, const struct equation *equations, int count,
		struct doubt *out)
{
	struct readings r;
	struct sums sums[CAMERA_MAX];
	struct belief all_good = {.bad_mask = 0};

	if (count < 2)
		return -EDOM;
	r.count = 0;
	for (int i = 0; i < count; i++) {
		sums[i] = sums_of(&equations[i]);
		sums_add(&all_good.sums, &sums[i], 1);
	}
	add_reading(&r, &all_good);
	if (r.count == 0)
		return -EDOM;
	doubt_from(&r, sightings, equations, sums, count, &all_good, &r.list[0],
		   !most_are_parts(sightings, count));
	/* One that lies and boasts made suspects of those that it contradicts, and hides others. */
	if (count > SUSPECT_MAX && best_reading(&r)->bad_mask) {
		struct reading best = *best_reading(&r);

		doubt_from(&r, sightings, equations, sums, count, &all_good, &best, false);
	}
	for (int i = 0; i < r.suspect_count; i++)
		add_poor(&r, &all_good, &r.suspects[i]);
	add_boast(&r, &all_good.sums, count);
	normalise(&r);
	average(&r, out);
	return 0;
}
