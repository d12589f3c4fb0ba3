/*
 * Small dense symmetric systems, as normal equations have them. Pure.
 */
#pragma once

#include <math.h>

#define SMALL_SOLVE_MAX 12

/* Solves A x = b in place of b; A, n x n row by row, is symmetric positive definite and is
 * overwritten (Cholesky). Returns 0 or -1 when A is singular: then b is spoilt. */
int small_solve(int n, double *a, double *b);

/* Adds one row of a least-squares problem, weight * (row x = value), to the upper and lower half
 * of A = J'J and to b = J'y. */
static inline void small_solve_add(int n, double *a, double *b, const double *row, double value,
				   double weight)
{
	for (int i = 0; i < n; i++) {
		double scaled = weight * row[i];

		b[i] += scaled * value;
		for (int j = 0; j < n; j++)
			a[i * n + j] += scaled * row[j];
	}
}
