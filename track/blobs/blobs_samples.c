/*
 * What the level map samples: sparse pixels of 8 bits around a node, sixteen at a time.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"

#define SAMPLE_BYTES 16
#define SAMPLE_COUNT 8 /* side by side, around a node */

typedef simde__m128i bytes16;
typedef simde__m256i bytes32;

static bytes16 load(const uint8_t *p)
{
	return simde_mm_loadu_si128((const bytes16 *)p);
}

/* Where the samples of a node begin: column i stands 8 px into group i, samples reach 64 px to both
 * sides. At the border they move inwards; in a narrow image they overlap. */
static int sample_x(const struct grey_image *image, int i, int k)
{
	int x = GROUP_PX * i + 8 - GROUP_PX + SAMPLE_BYTES * k;
	int last = image->width_px - SAMPLE_BYTES;

	return x < 0 ? 0 : x > last ? last : x;
}

static void load_samples(const struct grey_image *image, int i, int j, bytes16 v[SAMPLE_COUNT])
{
	const uint8_t *row = sampled_row(image, j);
	uint8_t narrow[SAMPLE_BYTES];

	if (i > 0 && GROUP_PX * (i + 1) + 8 <= image->width_px) {
		for (int k = 0; k < SAMPLE_COUNT; k++)
			v[k] = load(row + GROUP_PX * (i - 1) + 8 + SAMPLE_BYTES * k);
		return;
	}
	if (image->width_px < SAMPLE_BYTES) {
		for (int k = 0; k < SAMPLE_BYTES; k++)
			narrow[k] = row[k % image->width_px];
		for (int k = 0; k < SAMPLE_COUNT; k++)
			v[k] = load(narrow);
		return;
	}
	for (int k = 0; k < SAMPLE_COUNT; k++)
		v[k] = load(row + sample_x(image, i, k));
}

static void order(bytes16 *a, bytes16 *b)
{
	bytes16 low = simde_mm_min_epu8(*a, *b);

	*b = simde_mm_max_epu8(*a, *b);
	*a = low;
}

static int lane_sum(bytes16 sums)
{
	return simde_mm_cvtsi128_si32(sums) + simde_mm_cvtsi128_si32(simde_mm_srli_si128(sums, 8));
}

/* Mean of the 16 lanes' medians of 8. */
static float median_level(bytes16 v[SAMPLE_COUNT])
{
	bytes16 sum;

#pragma GCC unroll 17
	for (size_t i = 0; i < MEDIAN_NET_COUNT; i++)
		order(&v[median_net[i][0]], &v[median_net[i][1]]);
	sum = simde_mm_add_epi64(simde_mm_sad_epu8(v[3], simde_mm_setzero_si128()),
				 simde_mm_sad_epu8(v[4], simde_mm_setzero_si128()));
	return (float)lane_sum(sum) / 32.0f;
}

float sample_level(const struct grey_image *image, int i, int j)
{
	bytes16 v[SAMPLE_COUNT];

	load_samples(image, i, j, v);
	return median_level(v);
}

/* 14 differences each of two samples. */
int sample_noise(const struct grey_image *image, int i, int j)
{
	bytes16 mask = simde_mm_srli_si128(simde_mm_set1_epi8(-1), 2), v[SAMPLE_COUNT], a, b;

	load_samples(image, i, j, v);
	a = simde_mm_sad_epu8(simde_mm_and_si128(v[2], mask), simde_mm_srli_si128(v[2], 2));
	b = simde_mm_sad_epu8(simde_mm_and_si128(v[6], mask), simde_mm_srli_si128(v[6], 2));
	return lane_sum(simde_mm_add_epi64(a, b));
}

/* Away from the border both at once: a half of each vector is one's, and the samples of the second
 * begin where those of the first are half over. */
void sample_two_levels(const struct grey_image *image, int i, int j, float out[2])
{
	const uint8_t *p = sampled_row(image, j) + GROUP_PX * (i - 1) + 8;
	bytes32 v[SAMPLE_COUNT], sum, zero = simde_mm256_setzero_si256();

	if (i == 0 || GROUP_PX * (i + 2) + 8 > image->width_px) {
		out[0] = sample_level(image, i, j);
		out[1] = sample_level(image, i + 1, j);
		return;
	}
	for (int k = 0; k < SAMPLE_COUNT; k++)
		v[k] = simde_mm256_set_m128i(load(p + GROUP_PX + SAMPLE_BYTES * k),
					     load(p + SAMPLE_BYTES * k));
#pragma GCC unroll 17
	for (size_t s = 0; s < MEDIAN_NET_COUNT; s++) {
		bytes32 a = v[median_net[s][0]], b = v[median_net[s][1]];

		v[median_net[s][0]] = simde_mm256_min_epu8(a, b);
		v[median_net[s][1]] = simde_mm256_max_epu8(a, b);
	}
	sum = simde_mm256_add_epi64(simde_mm256_sad_epu8(v[3], zero),
				    simde_mm256_sad_epu8(v[4], zero));
	out[0] = (float)lane_sum(simde_mm256_castsi256_si128(sum)) / 32.0f;
	out[1] = (float)lane_sum(simde_mm256_extracti128_si256(sum, 1)) / 32.0f;
}
