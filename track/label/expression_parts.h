/*
 * Between reading an expression and learning what a face can do. Millimetres, in single precision:
 * four at a time.
 */
#pragma once

#include "track/label/expression.h"

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

/* What a row is off by when there is so much of each of the first `count` patterns. */
static inline void row_off_mm(const struct expression_row *row, const float *amount, int count,
			      const float d[3], float off[3])
{
	for (int c = 0; c < 3; c++) {
		float sum = 0;

		for (int k = 0; k < count; k++)
			sum += row->shift_mm[c][k] * amount[k];
		off[c] = d[c] - sum;
	}
}

/* Patterns are worked on by fours; those behind the last are nothing. */
static inline int whole_fours(int count)
{
	return (count + 3) / 4 * 4;
}

static inline float sum_of_squares(const float *v)
{
	float sum = 0;

	for (int k = 0; k < PATTERN_MAX; k++)
		sum += v[k] * v[k];
	return sum;
}

/* Right-hand sides, solved together. */
typedef double sides __attribute__((vector_size(32)));
#define SIDES 4

/* Upper triangle of rows and columns first .. count - 1: what its transpose times it gives. `least`
 * is on the diagonal alone. Every row is done with before the next, along rows in memory. */
static inline void factorise(double a[PATTERN_MAX][PATTERN_MAX], int first, int count, double least)
{
	for (int k = first; k < count; k++) {
		a[k][k] = sqrt(a[k][k] > least / 2 ? a[k][k] : least / 2);
		for (int j = k + 1; j < count; j++)
			a[k][j] /= a[k][k];
		for (int i = k + 1; i < count; i++)
			for (int j = i; j < count; j++)
				a[i][j] -= a[k][i] * a[k][j];
	}
}

/* By the factor's transpose. */
static inline void solve_lower(const double u[PATTERN_MAX][PATTERN_MAX], int first, int count,
			       sides *b)
{
	for (int k = first; k < count; k++) {
		b[k] /= u[k][k];
		for (int i = k + 1; i < count; i++)
			b[i] -= u[k][i] * b[k];
	}
}

static inline void solve_upper(const double u[PATTERN_MAX][PATTERN_MAX], int first, int count,
			       sides *b)
{
	for (int k = count - 1; k >= first; k--) {
		b[k] /= u[k][k];
		for (int i = first; i < k; i++)
			b[i] -= u[i][k] * b[k];
	}
}
