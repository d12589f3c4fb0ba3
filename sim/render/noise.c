/*
 * Tables of equally likely values: one random index is one noisy value.
 */
#include "sim/render/noise.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

static double normal_cumulative(double x)
{
	return 0.5 * erfc(-x * M_SQRT1_2);
}

/* Medians of `count` equal shares of the normal distribution, found upwards by Newton steps,
 * mirrored, and scaled to variance 1, because the shares at the ends lose a little of it. */
static void fill_normals(float *normals, int count)
{
	double x = -4.3, sum = 0;

	for (int i = 0; i < count / 2; i++) {
		double wanted = (i + 0.5) / count;

		for (int step = 0; step < 4; step++)
			x += (wanted - normal_cumulative(x)) * sqrt(2.0 * M_PI) * exp(0.5 * x * x);
		normals[i] = (float)x;
		normals[count - 1 - i] = (float)-x;
		sum += 2.0 * x * x;
	}
	float scale = (float)sqrt(count / sum);

	for (int i = 0; i < count; i++)
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
	float *normals = malloc(BACKGROUND_COUNT * sizeof(*normals));

	if (!noise || !normals)
		goto fail;
	noise->background_grey = background_grey;
	fill_normals(normals, BACKGROUND_COUNT);
	for (int i = 0; i < BACKGROUND_COUNT; i++)
		noise->background[i] = expose((float)background_grey, normals[i]);
	fill_normals(noise->normals, NORMAL_COUNT);
	free(normals);
	*out = noise;
	return 0;
fail:
	free(noise);
	free(normals);
	return -ENOMEM;
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

void noise_expose(const struct noise *noise, struct rng *rng, const float *light_grey,
		  uint8_t *pixels, size_t count)
{
	float background = (float)noise->background_grey;

	for (size_t i = 0; i < count; i++)
		pixels[i] = expose(background + light_grey[i],
				   noise->normals[rng_u32(rng) % NORMAL_COUNT]);
}
