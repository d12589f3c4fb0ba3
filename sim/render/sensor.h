/*
 * A sensor's noise by either model: what makes grey values of light.
 */
#pragma once

#include "sim/render/noise.h"
#include "sim/render/noise_patterned.h"

struct sensor {
	struct noise *even;                /* this one, */
	struct patterned_noise *patterned; /* or this one */
	const int16_t *rows; /* of the current picture, with patterned noise; borrowed */
};

/* What the sensor makes of `count` pixels from (x, y) on, lit by light_grey above the background.
 */
static inline void sensor_expose(const struct sensor *sensor, struct rng *rng, int x, int y,
				 const float *light_grey, uint8_t *pixels, size_t count)
{
	if (sensor->patterned)
		patterned_noise_expose(sensor->patterned, rng, sensor->rows, x, y, light_grey,
				       pixels, count);
	else
		noise_expose(sensor->even, rng, light_grey, pixels, count);
}
