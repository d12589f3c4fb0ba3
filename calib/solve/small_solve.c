/*
 * Cholesky factorisation in place.
 */
#include "calib/solve/small_solve.h"

#define PIVOT_MIN 1e-14 /* of the diagonal it started with */

static int factorise(int n, double *a)
{
	for (int j = 0; j < n; j++) {
		double start = a[j * n + j], pivot = start;

		for (int k = 0; k < j; k++)
			pivot -= a[j * n + k] * a[j * n + k];
		if (!(pivot > PIVOT_MIN * start))
			return -1;
		a[j * n + j] = sqrt(pivot);
		for (int i = j + 1; i < n; i++) {
			double sum = a[i * n + j];

			for (int k = 0; k < j; k++)
				sum -= a[i * n + k] * a[j * n + k];
			a[i * n + j] = sum / a[j * n + j];
		}
	}
	return 0;
}

int small_solve(int n, double *a, double *b)
{
	if (factorise(n, a))
		return -1;
	for (int i = 0; i < n; i++) {
		for (int k = 0; k < i; k++)
			b[i] -= a[i * n + k] * b[k];
		b[i] /= a[i * n + i];
	}
	for (int i = n - 1; i >= 0; i--) {
		for (int k = i + 1; k < n; k++)
			b[i] -= a[k * n + i] * b[k];
		b[i] /= a[i * n + i];
	}
	return 0;
}
