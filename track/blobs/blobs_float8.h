/*
 * Eight floats side by side; where registers hold four, two of them stand for one of eight, and the
 * results are the same.
 */
#pragma once

#include <simde/x86/avx2.h>

typedef simde__m256 float8;

static inline float8 all(float v)
{
	return simde_mm256_set1_ps(v);
}
static inline float8 load8(const float v[8])
{
	return simde_mm256_loadu_ps(v);
}
static inline void store8(float out[8], float8 v)
{
	simde_mm256_storeu_ps(out, v);
}
static inline float8 add(float8 a, float8 b)
{
	return simde_mm256_add_ps(a, b);
}
static inline float8 sub(float8 a, float8 b)
{
	return simde_mm256_sub_ps(a, b);
}
static inline float8 mul(float8 a, float8 b)
{
	return simde_mm256_mul_ps(a, b);
}
static inline float8 over(float8 a, float8 b)
{
	return simde_mm256_div_ps(a, b);
}
static inline float8 root(float8 v)
{
	return simde_mm256_sqrt_ps(v);
}
static inline float8 greater(float8 a, float8 b)
{
	return simde_mm256_max_ps(a, b);
}
static inline float8 lesser(float8 a, float8 b)
{
	return simde_mm256_min_ps(a, b);
}

/* All bits where a > b. */
static inline float8 exceeds(float8 a, float8 b)
{
	return simde_mm256_cmp_ps(a, b, SIMDE_CMP_GT_OQ);
}
static inline float8 both(float8 a, float8 b)
{
	return simde_mm256_and_ps(a, b);
}
static inline float8 select8(float8 where, float8 then, float8 otherwise)
{
	return simde_mm256_or_ps(simde_mm256_and_ps(where, then),
				 simde_mm256_andnot_ps(where, otherwise));
}
