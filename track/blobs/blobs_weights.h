/*
 * Integer sums over the weights of a small spot, sixteen pixels at a time; each lane adds up a
 * share.
 */
#pragma once

#include <simde/x86/sse2.h>

#define CHUNK_PX 16

typedef simde__m128i vec;

struct weight_sums {
	vec w, wx, wy, peak;
};

/* Adds sixteen weights, the first of them at (dx, dy). */
static inline void add_chunk(struct weight_sums *sums, vec w, int dx, int dy)
{
	vec zero = simde_mm_setzero_si128(), row = simde_mm_sad_epu8(w, zero);
	vec x = simde_mm_add_epi16(simde_mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7),
				   simde_mm_set1_epi16((short)dx));
	vec left = simde_mm_madd_epi16(simde_mm_unpacklo_epi8(w, zero), x);
	vec right = simde_mm_madd_epi16(simde_mm_unpackhi_epi8(w, zero),
					simde_mm_add_epi16(x, simde_mm_set1_epi16(8)));

	sums->w = simde_mm_add_epi32(sums->w, row);
	sums->wx = simde_mm_add_epi32(sums->wx, simde_mm_add_epi32(left, right));
	sums->wy = simde_mm_add_epi32(sums->wy,
				      simde_mm_madd_epi16(row, simde_mm_set1_epi16((short)dy)));
}

static inline int total(vec v)
{
	v = simde_mm_add_epi32(v, simde_mm_srli_si128(v, 8));
	return simde_mm_cvtsi128_si32(simde_mm_add_epi32(v, simde_mm_srli_si128(v, 4)));
}

static inline int greatest(vec v)
{
	v = simde_mm_max_epu8(v, simde_mm_srli_si128(v, 8));
	v = simde_mm_max_epu8(v, simde_mm_srli_si128(v, 4));
	v = simde_mm_max_epu8(v, simde_mm_srli_si128(v, 2));
	v = simde_mm_max_epu8(v, simde_mm_srli_si128(v, 1));
	return simde_mm_cvtsi128_si32(v) & 255;
}
