/*
 * How long things took, in fixed memory: counts in buckets whose width grows with the value, so
 * that any percentile is known to 1/32 of itself (after HdrHistogram, G. Tene). Pure.
 */
#pragma once

#include <stdint.h>

#define HISTOGRAM_SUB_BITS 5                      /* 32 buckets per doubling */
#define HISTOGRAM_MAX_NS ((INT64_C(1) << 40) - 1) /* 18 minutes; longer counts as that */
#define HISTOGRAM_BUCKETS ((40 - HISTOGRAM_SUB_BITS + 1) << HISTOGRAM_SUB_BITS)

/* A zeroed one is empty. */
struct histogram {
	uint64_t count;
	int64_t max_ns; /* exact */
	uint64_t buckets[HISTOGRAM_BUCKETS];
};

/* A negative value counts as 0: two clocks may disagree by a little. */
void histogram_add(struct histogram *histogram, int64_t value_ns);
void histogram_merge(struct histogram *into, const struct histogram *from);

/* The value that `part` (0..1) of all values do not exceed: at least the true one, at most 1/32
 * above it and never above the maximum. 0 when empty. */
int64_t histogram_part_ns(const struct histogram *histogram, double part);
