/*
 * The sensor's noise: photons, read-out and 8-bit steps, from tables that are indexed by random
 * bits. Deterministic.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "base/rng.h"

#define SENSOR_ELECTRONS_PER_GREY 40.0
#define SENSOR_READ_GREY 2.0
#define NORMAL_COUNT 8192 /* small enough to stay in a near cache; reaches 3.8 sigma */
#define BACKGROUND_COUNT 65536

struct noise {
	double background_grey;
	float normals[NORMAL_COUNT];          /* equally likely values of mean 0 and variance 1 */
	uint8_t background[BACKGROUND_COUNT]; /* equally likely values of an unlit pixel */
};

/* Returns 0 or -ENOMEM. destroy accepts NULL. */
int noise_create(struct noise **out, double background_grey);
void noise_destroy(struct noise *noise);

void noise_fill_background(const struct noise *noise, struct rng *rng, uint8_t *pixels,
			   size_t count);

/* What the sensor makes of `count` pixels lit by light_grey above the background. */
void noise_expose(const struct noise *noise, struct rng *rng, const float *light_grey,
		  uint8_t *pixels, size_t count);
