/*
 * What the level map samples: sparse pixels of 16 bits around a node, sixteen at a time.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"

#define SAMPLE_PX 16
#define SAMPLE_COUNT 8 /* side by side, around a node */

typedef simde__m256i words; /* sixteen of 16 bits */

/* Sample k of node (i, j); see blobs_samples.c. */
static void copy_sample(const struct grey_image *image, int i, int j, int k, grey out[SAMPLE_PX])
{
	const grey *row = sampled_row(image, j);
	int x = GROUP_PX * (i - 1) + 8 + SAMPLE_PX * k, last = image->width_px - SAMPLE_PX;

	x = x < last ? x : last;
	x = x > 0 ? x : 0;
	for (int n = 0; n < SAMPLE_PX; n++)
		out[n] = row[(x + n) % image->width_px];
}

static words load(const grey *p)
{
	return simde_mm256_loadu_si256((const words *)(const void *)p);
}

static void order(words *a, words *b)
{
	words low = simde_mm256_min_epu16(*a, *b);

	*b = simde_mm256_max_epu16(*a, *b);
	*a = low;
}

float sample_level(const struct grey_image *image, int i, int j)
{
	grey middle[2 * SAMPLE_PX];
	words v[SAMPLE_COUNT];
	int sum = 0;

	for (int k = 0; k < SAMPLE_COUNT; k++) {
		copy_sample(image, i, j, k, middle);
		v[k] = load(middle);
	}
	for (size_t n = 0; n < MEDIAN_NET_COUNT; n++)
		order(&v[median_net[n][0]], &v[median_net[n][1]]);
	simde_mm256_storeu_si256((words *)(void *)middle, v[3]);
	simde_mm256_storeu_si256((words *)(void *)(middle + SAMPLE_PX), v[4]);
	for (int n = 0; n < 2 * SAMPLE_PX; n++)
		sum += middle[n];
	return (float)sum / 32.0f;
}

void sample_two_levels(const struct grey_image *image, int i, int j, float out[2])
{
	out[0] = sample_level(image, i, j);
	out[1] = sample_level(image, i + 1, j);
}

/* 14 differences each of two samples. */
int sample_noise(const struct grey_image *image, int i, int j)
{
	static const int taken[] = {2, 6};
	grey sample[SAMPLE_PX];
	int sum = 0;

	for (int t = 0; t < 2; t++) {
		copy_sample(image, i, j, taken[t], sample);
		for (int n = 0; n + 2 < SAMPLE_PX; n++)
			sum += sample[n] > sample[n + 2] ? sample[n] - sample[n + 2]
							 : sample[n + 2] - sample[n];
	}
	return sum;
}
