/*
 * The noise model of a camera from images of a scene that does not move: photon transfer (Janesick
 * 2007, ch. 5). The difference of two images of the same light is noise alone, whatever is in the
 * picture; its variance rises with the light by one over the electrons that a grey value stands
 * for. No allocation, no files.
 */
#pragma once

#include <stdint.h>

#define NOISE_REACH 64 /* grey values; larger differences are motion */

/* Of one grey value, over all pairs of images. */
struct noise_level {
	double count, squares; /* of differences that are noise, about the mean of their pair */
	uint64_t pixel_count;
};

struct noise_meter {
	uint32_t pair[256][2 * NOISE_REACH + 1]; /* differences of one pair, by their mean light */
	struct noise_level levels[256];
};

struct noise_model {
	double electrons_per_grey, electrons_per_grey_sigma;
	double read_noise_grey;        /* standard deviation in the dark, rounding taken off */
	int dark_grey;                 /* the median of all pixels */
	int lowest_grey, highest_grey; /* of the light that told */
};

void noise_meter_reset(struct noise_meter *meter);

/* Adds two images of the same light. */
void noise_meter_add(struct noise_meter *meter, const uint8_t *a, const uint8_t *b, int width_px,
		     int height_px, int stride_a_bytes, int stride_b_bytes);

/* Returns 0; -ENODATA when less than NOISE_SPAN_GREY grey values hold enough pixels; -ERANGE when
 * the noise does not rise with the light (an image processed in the camera, or one that moves). */
int noise_meter_solve(const struct noise_meter *meter, struct noise_model *out);

#define NOISE_SPAN_GREY 16
