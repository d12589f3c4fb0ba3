/*
 * Between reading an expression and learning what a face can do. Millimetres, in single precision:
 * four at a time.
 */
#pragma once

#include "track/expression.h"

#define MM 1e-3
#define KEEP_S 0.02f /* a row stays as it is until it has been watched for longer */

_Static_assert(PATTERN_MAX == 16, "four times four");

static inline bool is_skin(const struct tracker_state *state, int i, int actor)
{
	return state->labels[i].frame == actor && state->labels[i].kind == LABEL_SKIN;
}

static inline void displacement_mm(const struct label_state *label, struct vec3 seen_m, float d[3])
{
	d[0] = (float)((seen_m.x - label->master_m.x) / MM);
	d[1] = (float)((seen_m.y - label->master_m.y) / MM);
	d[2] = (float)((seen_m.z - label->master_m.z) / MM);
}

/* What a row is off by when there is so much of each pattern. */
static inline void row_off_mm(const struct expression_row *row, const float *amount,
			      const float d[3], float off[3])
{
	for (int c = 0; c < 3; c++) {
		float sum = 0;

		for (int k = 0; k < PATTERN_MAX; k++)
			sum += row->shift_mm[c][k] * amount[k];
		off[c] = d[c] - sum;
	}
}

static inline float sum_of_squares(const float *v)
{
	float sum = 0;

	for (int k = 0; k < PATTERN_MAX; k++)
		sum += v[k] * v[k];
	return sum;
}

/* Lower triangle of rows and columns first .. count - 1; `least` is on the diagonal alone. */
static inline void factorise(double a[PATTERN_MAX][PATTERN_MAX], int first, int count, double least)
{
	for (int i = first; i < count; i++)
		for (int j = first; j <= i; j++) {
			double sum = a[i][j];

			for (int k = first; k < j; k++)
				sum -= a[i][k] * a[j][k];
			a[i][j] = i == j ? sqrt(fmax(sum, least / 2)) : sum / a[j][j];
		}
}

static inline void solve_lower(const double l[PATTERN_MAX][PATTERN_MAX], int first, int count,
			       double *b)
{
	for (int i = first; i < count; i++) {
		for (int k = first; k < i; k++)
			b[i] -= l[i][k] * b[k];
		b[i] /= l[i][i];
	}
}

static inline void solve_upper(const double l[PATTERN_MAX][PATTERN_MAX], int first, int count,
			       double *b)
{
	for (int i = count - 1; i >= first; i--) {
		for (int k = i + 1; k < count; k++)
			b[i] -= l[k][i] * b[k];
		b[i] /= l[i][i];
	}
}
