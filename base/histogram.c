/*
 * Bucket index: below 32 the value itself; from there the position of its leading bit and the five
 * bits behind that.
 */
#include "base/histogram.h"

#include <math.h>

#define SUB_COUNT (UINT32_C(1) << HISTOGRAM_SUB_BITS)

static uint32_t bucket_of(int64_t value_ns)
{
	if (value_ns < (int64_t)SUB_COUNT)
		return (uint32_t)value_ns;
	uint32_t shift = 63u - (uint32_t)__builtin_clzll((uint64_t)value_ns) - HISTOGRAM_SUB_BITS;
	return (shift << HISTOGRAM_SUB_BITS) + (uint32_t)(value_ns >> shift);
}

static int64_t bucket_last_ns(uint32_t bucket)
{
	if (bucket < SUB_COUNT)
		return bucket;
	uint32_t shift = (bucket >> HISTOGRAM_SUB_BITS) - 1;
	int64_t begin = bucket - (shift << HISTOGRAM_SUB_BITS);

	return ((begin + 1) << shift) - 1;
}

void histogram_add(struct histogram *histogram, int64_t value_ns)
{
	if (value_ns < 0)
		value_ns = 0;
	if (value_ns > HISTOGRAM_MAX_NS)
		value_ns = HISTOGRAM_MAX_NS;
	histogram->count++;
	histogram->buckets[bucket_of(value_ns)]++;
	if (value_ns > histogram->max_ns)
		histogram->max_ns = value_ns;
}

void histogram_merge(struct histogram *into, const struct histogram *from)
{
	into->count += from->count;
	for (uint32_t b = 0; b < HISTOGRAM_BUCKETS; b++)
		into->buckets[b] += from->buckets[b];
	if (from->max_ns > into->max_ns)
		into->max_ns = from->max_ns;
}

int64_t histogram_part_ns(const struct histogram *histogram, double part)
{
	uint64_t wanted = (uint64_t)ceil(part * (double)histogram->count), seen = 0;

	if (wanted < 1)
		wanted = 1;
	for (uint32_t b = 0; b < HISTOGRAM_BUCKETS; b++) {
		seen += histogram->buckets[b];
		if (seen >= wanted)
			return bucket_last_ns(b) < histogram->max_ns ? bucket_last_ns(b)
								     : histogram->max_ns;
	}
	return histogram->max_ns;
}
