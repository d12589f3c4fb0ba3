/*
 * A pixel of 8 bits, and how its values are counted.
 */
#pragma once

#include <simde/x86/avx2.h>
#include <stddef.h>
#include <stdint.h>

#include "track/blobs/blobs.h"

typedef uint8_t grey;

#define GREY_BINS 256   /* of a histogram over all values */
#define NOISE_BINS 1024 /* of one over sums of differences */

/* The value of a pixel that holds all the light it can. */
static inline int grey_white(const struct grey_image *image)
{
	(void)image;
	return 255;
}

/* Values per 256th of the full scale, the unit in which the settings are. */
static inline float grey_unit(const struct grey_image *image)
{
	(void)image;
	return 1;
}

/* Values per bin, as a power of two. */
static inline int grey_bin_shift(const struct grey_image *image)
{
	(void)image;
	return 0;
}

static inline int noise_bin_shift(const struct grey_image *image)
{
	(void)image;
	return 0;
}

static inline int grey_bin(const struct grey_image *image, grey value)
{
	(void)image;
	return value;
}

/* Eight pixels, of 32 bits each. */
static inline simde__m256i grey_load8(const grey *p)
{
	return simde_mm256_cvtepu8_epi32(
		simde_mm_loadl_epi64((const simde__m128i *)(const void *)p));
}

/* Sixteen pixels of one value and sixteen of another, in one piece, as they will be read. */
static inline void grey_fill_cells(grey *p, int first, int second)
{
	simde__m128i a = simde_mm_set1_epi8((char)first), b = simde_mm_set1_epi8((char)second);

	simde_mm256_storeu_si256((simde__m256i *)(void *)p, simde_mm256_set_m128i(b, a));
}
