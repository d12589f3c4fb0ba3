/*
 * Tables of equally likely values: one random index is one noisy value.
 */
#include "sim/noise.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

static double normal_cumulative(double x)
{
	return 0.5 * erfc(-x * M_SQRT1_2);
}

/* Medians of NORMAL_COUNT equal shares of the normal distribution, found upwards by Newton steps,
 * mirrored, and scaled to variance 1, because the shares at the ends lose a little of it. */
static void fill_normals(float *normals)
{
	double x = -4.3, sum = 0;

	for (int i = 0; i < NORMAL_COUNT / 2; i++) {
		double wanted = (i + 0.5) / NORMAL_COUNT;

		for (int step = 0; step < 4; step++)
			x += (wanted - normal_cumulative(x)) * sqrt(2.0 * M_PI) * exp(0.5 * x * x);
		normals[i] = (float)x;
		normals[NORMAL_COUNT - 1 - i] = (float)-x;
		sum += 2.0 * x * x;
	}
	float scale = (float)sqrt(NORMAL_COUNT / sum);

	for (int i = 0; i < NORMAL_COUNT; i++)
		normals[i] *= scale;
}

static uint8_t expose(float mean_grey, float normal)
{
	float variance = (float)(SENSOR_READ_GREY * SENSOR_READ_GREY) +
			 mean_grey * (float)(1.0 / SENSOR_ELECTRONS_PER_GREY);
	float value = mean_grey + normal * sqrtf(variance) + 0.5f;

	return value <= 0 ? 0 : value >= 255 ? 255 : (uint8_t)value;
}

int noise_create(struct noise **out, double background_grey)
{
	struct noise *noise = malloc(sizeof(*noise));

	if (!noise)
		return -ENOMEM;
	noise->background_grey = background_grey;
	fill_normals(noise->normals);
	for (int i = 0; i < NORMAL_COUNT; i++)
		noise->background[i] = expose((float)background_grey, noise->normals[i]);
	*out = noise;
	return 0;
}

void noise_destroy(struct noise *noise)
{
	free(noise);
}

void noise_fill_background(const struct noise *noise, struct rng *rng, uint8_t *pixels,
			   size_t count)
{
	for (size_t i = 0; i + 1 < count; i += 2) {
		uint32_t bits = rng_u32(rng);

		pixels[i] = noise->background[bits & 0xffff];
		pixels[i + 1] = noise->background[bits >> 16];
	}
	if (count % 2)
		pixels[count - 1] = noise->background[rng_u32(rng) & 0xffff];
}

uint8_t noise_expose(const struct noise *noise, struct rng *rng, float light_grey)
{
	return expose((float)noise->background_grey + light_grey,
		      noise->normals[rng_u32(rng) >> 16]);
}
