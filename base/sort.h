/*
 * Numbers in order, for medians and for what lies at the ends. Not for real-time threads: qsort()
 * may allocate.
 */
#pragma once

#include <stdlib.h>

static inline int sort_compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static inline void sort_doubles(double *values, size_t count)
{
	qsort(values, count, sizeof(*values), sort_compare);
}
