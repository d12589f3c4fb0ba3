/*
 * The patterns of a face: each marker's row by least squares from what there was of each pattern,
 * and a new pattern where they leave too much over.
 */
#include <string.h>

#include "track/label/expression_parts.h"

#define LEARN_EVERY_S 0.024
#define FADE_S 20.0
#define OFF_MIN_MM 0.15f /* of a row: no marker tells better */
#define OFF_PRIOR_MM 2.0f
#define JAW_RAD 0.3   /* of one unit of the first pattern */
#define JAW_S 0.02f   /* what it is worth */
#define NEW_MM 1.5f   /* a marker is off by so much: there is another pattern ... */
#define NEW_MARKERS 3 /* ... if as many are off by half of it */
#define NEW_S 0.15
#define REPLACE_SHARE 0.25f /* a pattern that tells less than that of a new one gives way */
#define ROWS_MIN 3
#define ALL_ROWS_S 0.2
#define RISE_S 0.05
#define FALL_S 10.0
#define PRIOR_S 0.3

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

static double follow_mean(double mean, double now, double dt_s, double learned_s)
{
	double time_s = now > mean ? RISE_S : fmin(FALL_S, PRIOR_S + learned_s);

	return mean + (now - mean) * fmin(dt_s / time_s, 1);
}

/* Mean of the products of the amounts, over what they may be; its upper triangle. */
static void mean_square(const struct expression *now, float square[PATTERN_MAX][PATTERN_MAX])
{
	memset(square, 0, PATTERN_MAX * sizeof(square[0]));
	for (int j = 0; j < now->count; j++)
		for (int k = 0; k <= j; k++) {
			float sum = now->amount[j] * now->amount[k];

			for (int i = j; i < now->count; i++)
				sum += now->spread[j][i] * now->spread[k][i];
			square[k][j] = sum;
		}
}

/* The past fades, and this is added: for each marker what there was of each pattern, and how it lay
 * then. */
static void row_learn(struct expression_row *row, const struct expression *now,
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
	for (int j = 0; j < now->count; j++)
		for (int k = j / 4 * 4; k < whole_fours(now->count); k++)
			row->square[j][k] = kept * row->square[j][k] + share * square[j][k];
	for (int c = 0; c < 3; c++) {
		float own = share * d[c];

		for (int k = 0; k < whole_fours(now->count); k++)
			row->product[c][k] = kept * row->product[c][k] + own * now->amount[k];
	}
}

static void row_solve(struct expression_row *row, int count)
{
	double a[PATTERN_MAX][PATTERN_MAX];
	sides b[PATTERN_MAX] = {0};

	for (int i = 0; i < count; i++) {
		for (int j = i; j < count; j++)
			a[i][j] = row->square[i][j];
		a[i][i] += KEEP_S;
		for (int c = 0; c < 3; c++)
			b[i][c] = row->product[c][i] + KEEP_S * row->shift_mm[c][i];
	}
	factorise(a, 0, count, KEEP_S);
	solve_lower(a, 0, count, b);
	solve_upper(a, 0, count, b);
	for (int i = 0; i < count; i++)
		for (int c = 0; c < 3; c++)
			row->shift_mm[c][i] = (float)b[i][c];
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
		row_off_mm(&state->rows[i], now->amount, now->count, d, off);
		row_learn(&state->rows[i], now, square, d, off, dt_s);
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
