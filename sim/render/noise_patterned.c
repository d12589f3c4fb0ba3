/*
 * Unlit pixels take one random index into a table of equally likely values; lit ones draw a Poisson
 * number each. Grey values are fixed point, 1/128 grey.
 */
#include "sim/render/noise_patterned.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

#define UNITS 128                                           /* per grey value */
#define UNITS_PER_ELECTRON 4                                /* UNITS / ELECTRONS_PER_GREY */
#define OFFSET_UNITS 4                                      /* of a pixel's stored offset */
#define GAIN_UNIT 5e-4                                      /* of a pixel's stored gain */
#define DARK_COUNT 16384                                    /* 14 random bits */
#define READ_REACH ((int)(6 * PATTERNED_READ_GREY * UNITS)) /* of the table of read noise */
#define AMBIENT_MAX 200.0                                   /* grey values */
#define PHOTONS_MAX 7200 /* more than AMBIENT_MAX ever gives, by nine deviations */
#define VALUES (2 * READ_REACH + UNITS_PER_ELECTRON * PHOTONS_MAX)

struct patterned_noise {
	int width_px, height_px;
	double black_grey, ambient_grey;
	int16_t dark[DARK_COUNT]; /* equally likely values of an unlit pixel */
	int8_t *offset, *gain;    /* owned; of each pixel */
};

static double poisson_probability(int n, double mean)
{
	int sign;

	if (mean <= 0)
		return n == 0;
	return exp(n * log(mean) - mean - lgamma_r(n + 1.0, &sign));
}

/* Probabilities of the sum of photons and read noise, in units, from -READ_REACH on. */
static void fill_probabilities(double out[VALUES], double photons)
{
	double normal[2 * READ_REACH], sigma = PATTERNED_READ_GREY * UNITS;
	double reach = 9 * sqrt(photons) + 9;
	int first = (int)fmax(photons - reach, 0), end = (int)fmin(photons + reach, PHOTONS_MAX);

	for (int i = 0; i < 2 * READ_REACH; i++)
		normal[i] = exp(-0.5 * pow((i - READ_REACH) / sigma, 2));
	for (int n = first; n < end; n++) {
		double probability = poisson_probability(n, photons);

		for (int i = 0; i < 2 * READ_REACH; i++)
			out[i + UNITS_PER_ELECTRON * n] += probability * normal[i];
	}
}

static void fill_dark(struct patterned_noise *noise, double work[VALUES])
{
	double sum = 0, below = 0;
	int value = 0;

	fill_probabilities(work, noise->ambient_grey * PATTERNED_ELECTRONS_PER_GREY);
	for (int i = 0; i < VALUES; i++)
		sum += work[i];
	for (int i = 0; i < DARK_COUNT; i++) {
		while (value < VALUES - 1 && below + work[value] < (i + 0.5) / DARK_COUNT * sum)
			below += work[value++];
		noise->dark[i] =
			(int16_t)(value - READ_REACH + (int)lround(noise->black_grey * UNITS));
	}
}

static int8_t rounded(double value)
{
	return (int8_t)lround(fmin(fmax(value, -127), 127));
}

/* Mean 0 and variance 1, nearly normal, from -3.4 to 3.4: four dice of 256 faces. */
static double cast(struct rng *rng)
{
	uint32_t bits = rng_u32(rng);
	int sum = (int)((bits & 255) + (bits >> 8 & 255) + (bits >> 16 & 255) + (bits >> 24));

	return (sum - 510) / sqrt(4 * (65536 - 1) / 12.0);
}

static void fill_pattern(struct patterned_noise *noise, struct rng *rng)
{
	size_t count = (size_t)noise->width_px * (size_t)noise->height_px;

	for (size_t i = 0; i < count; i++) {
		noise->offset[i] =
			rounded(PATTERNED_OFFSET_GREY * UNITS / OFFSET_UNITS * cast(rng));
		noise->gain[i] = rounded(PATTERNED_GAIN / GAIN_UNIT * cast(rng));
	}
}

int patterned_noise_create(struct patterned_noise **out, int width_px, int height_px,
			   double black_grey, double ambient_grey, struct rng *rng)
{
	struct patterned_noise *noise = calloc(1, sizeof(*noise));
	double *work = calloc(VALUES, sizeof(*work));
	size_t count = (size_t)width_px * (size_t)height_px;

	if (!noise || !work)
		goto fail;
	noise->width_px = width_px;
	noise->height_px = height_px;
	noise->black_grey = black_grey;
	noise->ambient_grey = fmin(ambient_grey, AMBIENT_MAX);
	noise->offset = malloc(count);
	noise->gain = malloc(count);
	if (!noise->offset || !noise->gain)
		goto fail;
	fill_dark(noise, work);
	fill_pattern(noise, rng);
	free(work);
	*out = noise;
	return 0;
fail:
	free(work);
	patterned_noise_destroy(noise);
	return -ENOMEM;
}

void patterned_noise_destroy(struct patterned_noise *noise)
{
	if (!noise)
		return;
	free(noise->offset);
	free(noise->gain);
	free(noise);
}

void patterned_noise_fill_rows(const struct patterned_noise *noise, struct rng *rng, int16_t *rows)
{
	for (int y = 0; y < noise->height_px; y++)
		rows[y] = (int16_t)lround(PATTERNED_ROW_GREY * UNITS * rng_normal(rng));
}

static inline uint8_t digitised(int units)
{
	int grey = (units + UNITS / 2) / UNITS;

	return units < 0 ? 0 : grey > 255 ? 255 : (uint8_t)grey;
}

static void fill_row(const struct patterned_noise *noise, struct rng *rng, int row,
		     const int8_t *offset, uint8_t *pixels)
{
	const int16_t *dark = noise->dark;
	int x = 0;

	for (; x + 1 < noise->width_px; x += 2) {
		uint32_t bits = rng_u32(rng);

		pixels[x] =
			digitised(dark[bits & (DARK_COUNT - 1)] + row + OFFSET_UNITS * offset[x]);
		pixels[x + 1] = digitised(dark[bits >> 18] + row + OFFSET_UNITS * offset[x + 1]);
	}
	if (x < noise->width_px)
		pixels[x] = digitised(dark[rng_u32(rng) >> 18] + row + OFFSET_UNITS * offset[x]);
}

void patterned_noise_fill(const struct patterned_noise *noise, struct rng *rng, const int16_t *rows,
			  uint8_t *pixels)
{
	for (int y = 0; y < noise->height_px; y++) {
		size_t at = (size_t)y * (size_t)noise->width_px;

		fill_row(noise, rng, rows[y], noise->offset + at, pixels + at);
	}
}

/* Hoermann 1993, "The transformed rejection method for generating Poisson random variables",
 * algorithm PTRS. */
static double draw_many(struct rng *rng, double mean)
{
	double b = 0.931 + 2.53 * sqrt(mean), a = -0.059 + 0.02483 * b;
	double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4), v_r = 0.9277 - 3.6224 / (b - 2);

	for (;;) {
		double u = rng_uniform(rng) - 0.5, v = rng_uniform(rng);
		double us = 0.5 - fabs(u), k = floor((2 * a / us + b) * u + mean + 0.43);
		int sign;

		if (us >= 0.07 && v <= v_r)
			return k;
		if (k < 0 || (us < 0.013 && v > us))
			continue;
		if (log(v * inverse_alpha / (a / (us * us) + b)) <=
		    k * log(mean) - mean - lgamma_r(k + 1, &sign))
			return k;
	}
}

/* Up the distribution until the random share is used up. */
static double draw_few(struct rng *rng, double mean)
{
	double share = rng_uniform(rng);

	if (share < 1 - mean) /* which is less than exp(-mean) */
		return 0;
	double probability = exp(-mean);
	int n = 0;

	while (share > probability && n < 100) {
		share -= probability;
		probability *= mean / ++n;
	}
	return n;
}

/* Photons of the spot come to those of the ambient: sums of Poisson numbers are Poisson numbers. */
void patterned_noise_expose(const struct patterned_noise *noise, struct rng *rng,
			    const int16_t *rows, int x, int y, const float *light_grey,
			    uint8_t *pixels, size_t count)
{
	size_t at = (size_t)y * (size_t)noise->width_px + (size_t)x;

	for (size_t i = 0; i < count; i++) {
		double mean = (double)light_grey[i] * PATTERNED_ELECTRONS_PER_GREY *
			      (1 + GAIN_UNIT * noise->gain[at + i]);
		double photons = mean < 10 ? draw_few(rng, mean) : draw_many(rng, mean);
		int units = noise->dark[rng_u32(rng) >> 18] + rows[y] +
			    OFFSET_UNITS * noise->offset[at + i];

		pixels[i] = digitised(units + UNITS_PER_ELECTRON * (int)fmin(photons, 1e6));
	}
}
