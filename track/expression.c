/*
 * Millimetres inside, in single precision: four at a time.
 */
#include "track/expression.h"

#include <string.h>

_Static_assert(PATTERN_MAX == 16, "four times four");

#define MM 1e-3
#define LEARN_EVERY_S 0.024
#define FADE_S 20.0
#define TELLS_MIN 8
#define OFF_MIN_MM 0.15f /* of a row: no marker tells better */
#define OFF_PRIOR_MM 2.0f
#define OUTLIER2 16.0f /* squared sigmas from which a marker loses its weight */
#define ROUNDS 4
#define KEEP_S 0.02f   /* a row stays as it is until it has been watched for longer */
#define VAGUE_MM2 1.0f /* what a row is off by, squared, for each ... */
#define SAMPLE_S 0.1f  /* ... of the samples that it was learned from */
#define JAW_RAD 0.3    /* of one unit of the first pattern */
#define JAW_S 0.02f    /* what it is worth */
#define NEW_MM 1.5f    /* a marker is off by so much: there is another pattern ... */
#define NEW_MARKERS 3  /* ... if as many are off by half of it */
#define NEW_S 0.15
#define REPLACE_SHARE 0.25f /* a pattern that tells less than that of a new one gives way */
#define ROWS_MIN 3
#define ALL_ROWS_S 0.2
#define HOLD_S 0.15 /* an expression lasts */
#define RISE_S 0.05
#define FALL_S 10.0
#define PRIOR_S 0.3

static bool is_skin(const struct tracker_state *state, int i, int actor)
{
	return state->labels[i].frame == actor && state->labels[i].kind == LABEL_SKIN;
}

static void displacement_mm(const struct label_state *label, struct vec3 seen_m, float d[3])
{
	d[0] = (float)((seen_m.x - label->master_m.x) / MM);
	d[1] = (float)((seen_m.y - label->master_m.y) / MM);
	d[2] = (float)((seen_m.z - label->master_m.z) / MM);
}

void expression_init(struct tracker_state *state, int actor)
{
	struct expression_state *x = &state->expressions[actor];
	const struct frame_state *f = &state->frames[actor];

	x->count = 2;
	for (int k = 0; k < PATTERN_MAX; k++)
		x->variance[k] = 1;
	for (int i = f->label_first; i < f->label_end; i++) {
		struct expression_row *row = &state->rows[i];
		struct vec3 u = vec3_scale(state->labels[i].jaw_m_rad, JAW_RAD / MM);

		row->off_mm2 = row->worst_mm2 = OFF_PRIOR_MM * OFF_PRIOR_MM;
		row->shift_mm[0][1] = (float)u.x;
		row->shift_mm[1][1] = (float)u.y;
		row->shift_mm[2][1] = (float)u.z;
		for (int c = 0; c < 3; c++)
			row->product[c][1] = JAW_S * row->shift_mm[c][1];
		row->square[1][1] = JAW_S;
	}
}

/* What a row is off by when there is so much of each pattern. */
static void row_off_mm(const struct expression_row *row, const float *amount, const float d[3],
		       float off[3])
{
	for (int c = 0; c < 3; c++) {
		float sum = 0;

		for (int k = 0; k < PATTERN_MAX; k++)
			sum += row->shift_mm[c][k] * amount[k];
		off[c] = d[c] - sum;
	}
}

struct equations {
	float h[PATTERN_MAX][PATTERN_MAX], g[PATTERN_MAX];
};

/* Four rows of the lower triangle, in whole fours. */
static inline void add_square(float (*restrict h)[PATTERN_MAX], const float *restrict u,
			      float weight, int first, int end)
{
	for (int j = first; j < first + 4; j++)
		for (int k = 0; k < end; k++)
			h[j][k] += weight * u[j] * u[k];
}

static void add_row(struct equations *restrict q, const struct expression_row *row,
		    const float d[3], float weight)
{
	for (int c = 0; c < 3; c++) {
		const float *u = row->shift_mm[c];
		float own = weight * (d[c] - u[0]);

		for (int k = 0; k < PATTERN_MAX; k++)
			q->g[k] += own * u[k];
		add_square(q->h, u, weight, 0, 4);
		add_square(q->h, u, weight, 4, 8);
		add_square(q->h, u, weight, 8, 12);
		add_square(q->h, u, weight, 12, 16);
	}
}

/* Lower triangle of rows and columns first .. count - 1; `least` is on the diagonal alone. */
static void factorise(double a[PATTERN_MAX][PATTERN_MAX], int first, int count, double least)
{
	for (int i = first; i < count; i++)
		for (int j = first; j <= i; j++) {
			double sum = a[i][j];

			for (int k = first; k < j; k++)
				sum -= a[i][k] * a[j][k];
			a[i][j] = i == j ? sqrt(fmax(sum, least / 2)) : sum / a[j][j];
		}
}

static void solve_lower(const double l[PATTERN_MAX][PATTERN_MAX], int first, int count, double *b)
{
	for (int i = first; i < count; i++) {
		for (int k = first; k < i; k++)
			b[i] -= l[i][k] * b[k];
		b[i] /= l[i][i];
	}
}

static void solve_upper(const double l[PATTERN_MAX][PATTERN_MAX], int first, int count, double *b)
{
	for (int i = count - 1; i >= first; i--) {
		for (int k = i + 1; k < count; k++)
			b[i] -= l[k][i] * b[k];
		b[i] /= l[i][i];
	}
}

/* Before any marker is seen: each amount comes from the last one and falls back to nothing, as fast
 * as faces move (Ornstein and Uhlenbeck). */
static void expect(const struct expression_state *x, double age_s, struct equations *q)
{
	double kept = exp(-age_s / HOLD_S);

	memset(q, 0, sizeof(*q));
	for (int k = 1; k < x->count; k++) {
		double variance = 1 - kept * kept + kept * kept * x->variance[k];

		q->h[k][k] = (float)(1 / variance);
		q->g[k] = (float)(kept * x->amount[k] / variance);
	}
}

/* Rows of the inverse of the factor, turned about. */
static void spread_of(const double factor[PATTERN_MAX][PATTERN_MAX], int count,
		      float spread[PATTERN_MAX][PATTERN_MAX])
{
	memset(spread, 0, PATTERN_MAX * sizeof(spread[0]));
	for (int k = 1; k < count; k++) {
		double column[PATTERN_MAX] = {0};

		column[k] = 1;
		solve_lower(factor, k, count, column);
		for (int i = k; i < count; i++)
			spread[k][i] = (float)column[i];
	}
}

static void solve(const struct expression_state *x, const struct equations *q,
		  struct expression *out)
{
	double factor[PATTERN_MAX][PATTERN_MAX], b[PATTERN_MAX];

	for (int i = 1; i < x->count; i++) {
		for (int j = 1; j <= i; j++)
			factor[i][j] = q->h[i][j];
		b[i] = q->g[i];
	}
	factorise(factor, 1, x->count, 1);
	solve_lower(factor, 1, x->count, b);
	solve_upper(factor, 1, x->count, b);
	spread_of(factor, x->count, out->spread);
	memset(out->amount, 0, sizeof(out->amount));
	out->amount[0] = 1;
	for (int i = 1; i < x->count; i++)
		out->amount[i] = (float)b[i];
}

/* Of a marker that lies so far off: the name of one far off may be wrong. */
static float weight_of(const struct expression_row *row, const float off[3])
{
	float off2 = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]) / row->off_mm2;
	float share = off2 > OUTLIER2 ? OUTLIER2 / off2 : 1;

	return share * share / row->off_mm2;
}

/* Where that changes a weight. False when it changes none. */
static bool reweigh(const struct tracker_state *state, int actor, const bool *tells,
		    const struct vec3 *seen_m, const float *amount, float *weights,
		    struct equations *q)
{
	const struct frame_state *f = &state->frames[actor];
	bool any = false;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct expression_row *row = &state->rows[i];
		float d[3], off[3];

		if (!tells[i] || !is_skin(state, i, actor))
			continue;
		displacement_mm(&state->labels[i], seen_m[i], d);
		row_off_mm(row, amount, d, off);
		float weight = weight_of(row, off);
		if (weight == weights[i])
			continue;
		add_row(q, row, d, weight - weights[i]);
		weights[i] = weight;
		any = true;
	}
	return any;
}

void expression_solve(const struct tracker_state *state, int actor, int64_t now_ns,
		      const bool *tells, const struct vec3 *seen_m, struct expression *out)
{
	const struct expression_state *x = &state->expressions[actor];
	const struct frame_state *f = &state->frames[actor];
	float weights[LABEL_MAX], d[3];
	struct equations q;
	int count = 0;

	expect(x, (double)(now_ns - x->seen_ns) * 1e-9, &q);
	for (int i = f->label_first; i < f->label_end; i++) {
		if (!tells[i] || !is_skin(state, i, actor))
			continue;
		weights[i] = 1 / state->rows[i].off_mm2;
		displacement_mm(&state->labels[i], seen_m[i], d);
		add_row(&q, &state->rows[i], d, weights[i]);
		count++;
	}
	out->known = count >= TELLS_MIN;
	out->count = x->count;
	if (!out->known)
		return;
	solve(x, &q, out);
	for (int round = 1; round < ROUNDS; round++) {
		if (!reweigh(state, actor, tells, seen_m, out->amount, weights, &q))
			return;
		solve(x, &q, out);
	}
}

static float sum_of_squares(const float *v)
{
	float sum = 0;

	for (int k = 0; k < PATTERN_MAX; k++)
		sum += v[k] * v[k];
	return sum;
}

/* Of a row, by that of the amounts, per axis. */
static float variance_mm2(const struct expression_row *row,
			  const float (*restrict spread)[PATTERN_MAX])
{
	float sum = 0;

	for (int c = 0; c < 3; c++) {
		float w[PATTERN_MAX] = {0};

		for (int j = 1; j < PATTERN_MAX; j++)
			for (int k = 0; k < PATTERN_MAX; k++)
				w[k] += row->shift_mm[c][j] * spread[j][k];
		sum += sum_of_squares(w);
	}
	return sum / 3;
}

static struct told tell_row(const struct expression_row *row, const struct expression *expression,
			    struct vec3 master_m)
{
	const float *amount = expression->amount, none[3] = {0};
	float variance = row->worst_mm2 + variance_mm2(row, expression->spread), off[3];

	for (int k = 0; k < expression->count; k++)
		variance += SAMPLE_S * (row->worst_mm2 + VAGUE_MM2) * amount[k] * amount[k] /
			    (row->square[k][k] + KEEP_S);
	row_off_mm(row, amount, none, off);
	return (struct told){
		true, vec3_sub(master_m, vec3_scale((struct vec3){off[0], off[1], off[2]}, MM)),
		MM * sqrt(variance)};
}

void expression_tell(const struct tracker_state *state, int actor,
		     const struct expression *expression, const bool *tells, struct told *out)
{
	const struct frame_state *f = &state->frames[actor];

	for (int i = f->label_first; i < f->label_end; i++) {
		if (!is_skin(state, i, actor))
			continue;
		out[i].known = false;
		if (expression->known && !tells[i])
			out[i] = tell_row(&state->rows[i], expression, state->labels[i].master_m);
	}
}

static double follow_mean(double mean, double now, double dt_s, double learned_s)
{
	double time_s = now > mean ? RISE_S : fmin(FALL_S, PRIOR_S + learned_s);

	return mean + (now - mean) * fmin(dt_s / time_s, 1);
}

/* Mean of the products of the amounts, over what they may be. */
static void mean_square(const struct expression *now, float square[PATTERN_MAX][PATTERN_MAX])
{
	for (int j = 0; j < PATTERN_MAX; j++)
		for (int k = 0; k <= j; k++) {
			float sum = now->amount[j] * now->amount[k];

			for (int i = j; i < PATTERN_MAX; i++)
				sum += now->spread[j][i] * now->spread[k][i];
			square[j][k] = square[k][j] = sum;
		}
}

/* The past fades, and this is added: for each marker what there was of each pattern, and how it lay
 * then. */
static void row_learn(struct expression_row *row, const float *amount,
		      float (*restrict square)[PATTERN_MAX], const float d[3], const float off[3],
		      double dt_s)
{
	float kept = (float)(1 - fmin(dt_s / FADE_S, 1)), share = (float)dt_s;
	float off_mm2 = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]) / 3;

	row->learned_s += (float)dt_s;
	row->off_mm2 = (float)fmax(
		row->off_mm2 + (off_mm2 - row->off_mm2) *
				       fmin(dt_s / fmin(FALL_S, PRIOR_S + row->learned_s), 1),
		OFF_MIN_MM * OFF_MIN_MM);
	row->worst_mm2 = (float)fmax(follow_mean(row->worst_mm2, off_mm2, dt_s, row->learned_s),
				     OFF_MIN_MM * OFF_MIN_MM);
	for (int j = 0; j < PATTERN_MAX; j++)
		for (int k = 0; k < PATTERN_MAX; k++)
			row->square[j][k] = kept * row->square[j][k] + share * square[j][k];
	for (int c = 0; c < 3; c++) {
		float own = share * d[c];

		for (int k = 0; k < PATTERN_MAX; k++)
			row->product[c][k] = kept * row->product[c][k] + own * amount[k];
	}
}

static void row_solve(struct expression_row *row, int count)
{
	double a[PATTERN_MAX][PATTERN_MAX], b[PATTERN_MAX];

	for (int i = 0; i < count; i++) {
		for (int j = 0; j <= i; j++)
			a[i][j] = row->square[i][j];
		a[i][i] += KEEP_S;
	}
	factorise(a, 0, count, KEEP_S);
	for (int c = 0; c < 3; c++) {
		for (int k = 0; k < count; k++)
			b[k] = row->product[c][k] + KEEP_S * row->shift_mm[c][k];
		solve_lower(a, 0, count, b);
		solve_upper(a, 0, count, b);
		for (int k = 0; k < count; k++)
			row->shift_mm[c][k] = (float)b[k];
	}
}

/* A few rows at a time. */
static void solve_rows(struct tracker_state *state, int actor, double dt_s)
{
	struct expression_state *x = &state->expressions[actor];
	const struct frame_state *f = &state->frames[actor];
	int all = f->label_end - f->label_first;
	int count = (int)fmin(fmax(ROWS_MIN, all * dt_s / ALL_ROWS_S), all);

	for (; count > 0; count--) {
		int i = f->label_first + (int)(x->turn++ % (uint32_t)all);

		if (is_skin(state, i, actor) && state->rows[i].learned_s > 0)
			row_solve(&state->rows[i], x->count);
	}
}

/* What the patterns leave over in a shot. */
struct rest {
	float off_mm[LABEL_MAX][3];
	int off_count;
	bool is_new;
	float energy_mm2;
};

static float pattern_energy_mm2(const struct tracker_state *state, int actor, int k)
{
	const struct frame_state *f = &state->frames[actor];
	float sum = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		for (int c = 0; c < 3; c++)
			sum += state->rows[i].shift_mm[c][k] * state->rows[i].shift_mm[c][k];
	return sum;
}

/* Room for a new pattern: a free place, or that of one that tells little. 0: none. */
static int place_for_new(const struct tracker_state *state, int actor, float energy_mm2)
{
	const struct expression_state *x = &state->expressions[actor];
	float least_mm2 = REPLACE_SHARE * energy_mm2;
	int place = 0;

	if (x->count < PATTERN_MAX)
		return x->count;
	for (int k = 2; k < PATTERN_MAX; k++) {
		float its_mm2 = pattern_energy_mm2(state, actor, k);

		if (its_mm2 < least_mm2) {
			least_mm2 = its_mm2;
			place = k;
		}
	}
	return place;
}

static void add_pattern(struct tracker_state *state, int actor, const bool *sure,
			const struct rest *rest)
{
	struct expression_state *x = &state->expressions[actor];
	const struct frame_state *f = &state->frames[actor];
	int k = place_for_new(state, actor, rest->energy_mm2);

	if (k == 0)
		return;
	if (k == x->count)
		x->count++;
	x->variance[k] = 1;
	x->amount[k] = 0;
	x->since_new_s = 0;
	for (int i = f->label_first; i < f->label_end; i++) {
		struct expression_row *row = &state->rows[i];

		for (int j = 0; j < PATTERN_MAX; j++)
			row->square[k][j] = row->square[j][k] = 0;
		for (int c = 0; c < 3; c++) {
			row->shift_mm[c][k] =
				sure[i] && is_skin(state, i, actor) ? rest->off_mm[i][c] : 0;
			row->product[c][k] = 0;
		}
	}
}

static void learn_rows(struct tracker_state *state, int actor, const struct expression *now,
		       float square[PATTERN_MAX][PATTERN_MAX], double dt_s, const bool *sure,
		       const struct vec3 *seen_m, struct rest *rest)
{
	const struct frame_state *f = &state->frames[actor];

	rest->off_count = 0;
	rest->is_new = false;
	rest->energy_mm2 = 0;
	for (int i = f->label_first; i < f->label_end; i++) {
		float d[3], *off = rest->off_mm[i];

		if (!sure[i] || !is_skin(state, i, actor))
			continue;
		displacement_mm(&state->labels[i], seen_m[i], d);
		row_off_mm(&state->rows[i], now->amount, d, off);
		row_learn(&state->rows[i], now->amount, square, d, off, dt_s);
		float off_mm2 = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
		rest->energy_mm2 += off_mm2;
		rest->is_new |= off_mm2 > NEW_MM * NEW_MM;
		rest->off_count += off_mm2 > 0.25f * NEW_MM * NEW_MM;
	}
}

static void follow(struct expression_state *x, const struct expression *now, int64_t now_ns)
{
	x->seen_ns = now_ns;
	for (int k = 1; k < now->count; k++) {
		x->amount[k] = now->amount[k];
		x->variance[k] = sum_of_squares(now->spread[k]);
	}
}

void expression_learn(struct tracker_state *state, int actor, const struct expression *now,
		      int64_t now_ns, double dt_s, const bool *sure, const struct vec3 *seen_m)
{
	struct expression_state *x = &state->expressions[actor];
	float square[PATTERN_MAX][PATTERN_MAX];
	struct rest rest;

	if (now->known)
		follow(x, now, now_ns);
	x->since_learned_s += dt_s;
	x->since_new_s += dt_s;
	solve_rows(state, actor, dt_s);
	if (x->since_learned_s < LEARN_EVERY_S || !now->known)
		return;
	x->learned_s += x->since_learned_s;
	mean_square(now, square);
	learn_rows(state, actor, now, square, x->since_learned_s, sure, seen_m, &rest);
	x->since_learned_s = 0;
	if (rest.is_new && rest.off_count >= NEW_MARKERS && x->since_new_s > NEW_S)
		add_pattern(state, actor, sure, &rest);
}
