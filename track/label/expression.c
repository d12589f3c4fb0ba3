/*
 * How much of each pattern there is, from the markers that are seen, and where that puts the
 * others.
 */
#include <string.h>

#include "track/label/expression_parts.h"

#define TELLS_MIN 8
#define OUTLIER2 16.0f /* squared sigmas from which a marker loses its weight */
#define ROUNDS 4
#define VAGUE_MM2 1.0f /* what a row is off by, squared, for each ... */
#define SAMPLE_S 0.1f  /* ... of the samples that it was learned from */
#define HOLD_S 0.15    /* an expression lasts */

struct equations {
	float h[PATTERN_MAX][PATTERN_MAX], g[PATTERN_MAX];
};

/* Four patterns at once; the same sums as one by one. */
typedef float four __attribute__((vector_size(16)));

static inline four load(const float *v)
{
	four x;

	memcpy(&x, v, sizeof(x));
	return x;
}

static inline void store(float *v, four x)
{
	memcpy(v, &x, sizeof(x));
}

/* sum += x * u[0] + y * u[1] + z * u[2], the first `count`: whole fours. */
static inline void add_axes(float *restrict sum, const float (*restrict u)[PATTERN_MAX], float x,
			    float y, float z, int count)
{
	for (int k = 0; k < count; k += 4)
		store(sum + k,
		      load(sum + k) + x * load(u[0] + k) + y * load(u[1] + k) + z * load(u[2] + k));
}

/* The lower triangle alone counts. */
static void add_row(struct equations *restrict q, int count, const struct expression_row *row,
		    const float d[3], float weight)
{
	const float(*u)[PATTERN_MAX] = row->shift_mm;

	add_axes(q->g, u, weight * (d[0] - u[0][0]), weight * (d[1] - u[1][0]),
		 weight * (d[2] - u[2][0]), whole_fours(count));
	for (int j = 1; j < count; j++)
		add_axes(q->h[j], u, weight * u[0][j], weight * u[1][j], weight * u[2][j],
			 j / 4 * 4 + 4);
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

struct factor {
	double u[PATTERN_MAX][PATTERN_MAX];
};

/* Rows of the inverse of the factor. */
static void tell_spread(const struct factor *factor, struct expression *out)
{
	memset(out->spread, 0, sizeof(out->spread));
	for (int first = 1; first < out->count; first += SIDES) {
		sides b[PATTERN_MAX] = {0};

		for (int s = 0; s < SIDES && first + s < out->count; s++)
			b[first + s][s] = 1;
		solve_lower(factor->u, first, out->count, b);
		for (int s = 0; s < SIDES && first + s < out->count; s++)
			for (int i = first + s; i < out->count; i++)
				out->spread[first + s][i] = (float)b[i][s];
	}
}

static void solve(const struct equations *q, struct factor *factor, struct expression *out)
{
	sides b[PATTERN_MAX];

	for (int i = 1; i < out->count; i++) {
		for (int j = 1; j <= i; j++)
			factor->u[j][i] = q->h[i][j];
		b[i] = (sides){q->g[i]};
	}
	factorise(factor->u, 1, out->count, 1);
	solve_lower(factor->u, 1, out->count, b);
	solve_upper(factor->u, 1, out->count, b);
	memset(out->amount, 0, sizeof(out->amount));
	out->amount[0] = 1;
	for (int i = 1; i < out->count; i++)
		out->amount[i] = (float)b[i][0];
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
	int count = state->expressions[actor].count;
	bool any = false;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct expression_row *row = &state->rows[i];
		float d[3], off[3];

		if (!tells[i] || !is_skin(state, i, actor))
			continue;
		displacement_mm(&state->labels[i], seen_m[i], d);
		row_off_mm(row, amount, count, d, off);
		float weight = weight_of(row, off);
		if (weight == weights[i])
			continue;
		add_row(q, count, row, d, weight - weights[i]);
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
	struct factor factor;
	int count = 0;

	expect(x, (double)(now_ns - x->seen_ns) * 1e-9, &q);
	for (int i = f->label_first; i < f->label_end; i++) {
		if (!tells[i] || !is_skin(state, i, actor))
			continue;
		weights[i] = 1 / state->rows[i].off_mm2;
		displacement_mm(&state->labels[i], seen_m[i], d);
		add_row(&q, x->count, &state->rows[i], d, weights[i]);
		count++;
	}
	out->known = count >= TELLS_MIN;
	out->count = x->count;
	if (!out->known)
		return;
	solve(&q, &factor, out);
	for (int round = 1; round < ROUNDS; round++) {
		if (!reweigh(state, actor, tells, seen_m, out->amount, weights, &q))
			break;
		solve(&q, &factor, out);
	}
	tell_spread(&factor, out);
}

/* Of a row, by that of the amounts, per axis. */
static float variance_mm2(const struct expression_row *row, int count,
			  const float (*restrict spread)[PATTERN_MAX])
{
	const float(*u)[PATTERN_MAX] = row->shift_mm;
	four sum = {0};

	for (int k = 0; k < count; k += 4) {
		four x = {0}, y = {0}, z = {0};

		for (int j = 1; j < k + 4; j++) { /* a factor: nothing is below its diagonal */
			four s = load(spread[j] + k);

			x += u[0][j] * s;
			y += u[1][j] * s;
			z += u[2][j] * s;
		}
		sum += x * x + y * y + z * z;
	}
	return (sum[0] + sum[1] + sum[2] + sum[3]) / 3;
}

/* How far each pattern moves the marker that it moves most, squared, per axis: not known of a face
 * that was hardly watched. */
static void find_reach(const struct tracker_state *state, int actor, float reach_mm2[PATTERN_MAX])
{
	const struct frame_state *f = &state->frames[actor];
	int count = whole_fours(state->expressions[actor].count);

	for (int k = 0; k < PATTERN_MAX; k++)
		reach_mm2[k] = expression_is_learned(state, actor) ? 0 : INFINITY;
	for (int i = f->label_first; i < f->label_end; i++) {
		const float(*u)[PATTERN_MAX] = state->rows[i].shift_mm;

		if (!is_skin(state, i, actor))
			continue;
		for (int k = 0; k < count; k++) {
			float x = u[0][k], y = u[1][k], z = u[2][k];
			float its_mm2 = (x * x + y * y + z * z) / 3;

			reach_mm2[k] = its_mm2 > reach_mm2[k] ? its_mm2 : reach_mm2[k];
		}
	}
}

/* What a row is off by, as far as it was not watched while there was such an amount of a pattern:
 * the pattern moves no marker by more than its reach. */
static float unwatched_mm2(const struct expression_row *row, const float *amount, int count,
			   const float reach_mm2[PATTERN_MAX])
{
	float sample_mm2 = SAMPLE_S * (row->worst_mm2 + VAGUE_MM2), sum = 0;

	for (int k = 0; k < count; k++)
		sum += amount[k] * amount[k] * sample_mm2 /
		       (row->square[k][k] + fmaxf(KEEP_S, sample_mm2 / reach_mm2[k]));
	return sum;
}

static struct told tell_row(const struct expression_row *row, const struct expression *expression,
			    const float reach_mm2[PATTERN_MAX], struct vec3 master_m)
{
	const float *amount = expression->amount, none[3] = {0};
	float variance = row->worst_mm2, off[3];

	variance += variance_mm2(row, expression->count, expression->spread);
	variance += unwatched_mm2(row, amount, expression->count, reach_mm2);
	row_off_mm(row, amount, expression->count, none, off);
	return (struct told){
		true, vec3_sub(master_m, vec3_scale((struct vec3){off[0], off[1], off[2]}, MM)),
		MM * sqrt(variance)};
}

void expression_tell(const struct tracker_state *state, int actor,
		     const struct expression *expression, const bool *tells, struct told *out)
{
	const struct frame_state *f = &state->frames[actor];
	float reach_mm2[PATTERN_MAX];

	find_reach(state, actor, reach_mm2);
	for (int i = f->label_first; i < f->label_end; i++) {
		if (!is_skin(state, i, actor))
			continue;
		out[i].known = false;
		if (expression->known && !tells[i])
			out[i] = tell_row(&state->rows[i], expression, reach_mm2,
					  state->labels[i].master_m);
	}
}
