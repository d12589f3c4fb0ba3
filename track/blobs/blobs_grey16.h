/*
 * A pixel of 16 bits, of which image.bits are used, and how its values are counted. What lies above
 * the full scale counts as white.
 */
#pragma once

#include <simde/x86/avx2.h>
#include <stddef.h>
#include <stdint.h>

#include "track/blobs/blobs.h"

typedef uint16_t grey;

#define GREY_BINS 4096
#define NOISE_BINS 16384

static inline int grey_white(const struct grey_image *image)
{
	return (1 << image->bits) - 1;
}

static inline float grey_unit(const struct grey_image *image)
{
	return (float)(1 << image->bits) / 256;
}

static inline int grey_bin_shift(const struct grey_image *image)
{
	return image->bits > 12 ? image->bits - 12 : 0;
}

static inline int noise_bin_shift(const struct grey_image *image)
{
	return grey_bin_shift(image);
}

static inline int grey_bin(const struct grey_image *image, grey value)
{
	int white = grey_white(image);

	return (value < white ? value : white) >> grey_bin_shift(image);
}

static inline simde__m256i grey_load8(const grey *p)
{
	return simde_mm256_cvtepu16_epi32(
		simde_mm_loadu_si128((const simde__m128i *)(const void *)p));
}

/* Sixteen pixels of one value and sixteen of another. */
static inline void grey_fill_cells(grey *p, int first, int second)
{
	simde_mm256_storeu_si256((simde__m256i *)(void *)p, simde_mm256_set1_epi16((short)first));
	simde_mm256_storeu_si256((simde__m256i *)(void *)(p + 16),
				 simde_mm256_set1_epi16((short)second));
}
