/*
 * Another sensor's noise than sim/render/noise.h: photons that are counted one by one, and what is
 * the same in every picture or along a row. Deterministic.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "base/rng.h"

#define PATTERNED_ELECTRONS_PER_GREY 32.0
#define PATTERNED_READ_GREY 1.6
#define PATTERNED_ROW_GREY 0.4    /* of each row of a picture, anew in each */
#define PATTERNED_OFFSET_GREY 0.8 /* of each pixel, the same in all pictures (DSNU) */
#define PATTERNED_GAIN 0.01       /* of each pixel for spots, the same in all pictures (PRNU) */

struct patterned_noise;

/* The black level is without light; the ambient has photon noise. Returns 0 or -ENOMEM. destroy
 * accepts NULL. */
int patterned_noise_create(struct patterned_noise **out, int width_px, int height_px,
			   double black_grey, double ambient_grey, struct rng *rng);
void patterned_noise_destroy(struct patterned_noise *noise);

/* The rows' offsets of a new picture. */
void patterned_noise_fill_rows(const struct patterned_noise *noise, struct rng *rng, int16_t *rows);

/* A picture without a spot. */
void patterned_noise_fill(const struct patterned_noise *noise, struct rng *rng, const int16_t *rows,
			  uint8_t *pixels);

/* What the sensor makes of `count` pixels from (x, y) on, lit by light_grey above the ambient. */
void patterned_noise_expose(const struct patterned_noise *noise, struct rng *rng,
			    const int16_t *rows, int x, int y, const float *light_grey,
			    uint8_t *pixels, size_t count);
