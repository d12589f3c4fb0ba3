/*
 * How well a spot's place can be known, and how it shows: for a disc blurred by a Gaussian, on a
 * sensor with photon and read noise, by its Fisher information (Winick 1986, "Cramer-Rao lower
 * bounds on the performance of charge-coupled-device optical position estimators").
 */
#pragma once

#define BOUND_SIZES 24 /* of radius over blur */
#define BOUND_GREYS 28 /* of brightness */
#define BOUND_BLACK_GREY 10.0
#define BOUND_THRESHOLD_GREY 12.0 /* above the background: what a blob finder sees as a spot */

struct bound {
	float sigma_px;    /* of x and of y: no unbiased estimate is better */
	float reach_sigma; /* radius of what is above the threshold, in blurs; 0: not found */
	float peak_grey;   /* above the background, unclipped */
};

/* Pixels at the top of the range tell nothing of the place. */
struct bound_table {
	struct bound at[BOUND_SIZES][BOUND_GREYS];
};

void bound_table_init(struct bound_table *table, double variance_grey2, double electrons_per_grey);

/* `size` is the disc's radius over the blur's standard deviation, `grey` an evenly lit pixel. */
struct bound bound_of(const struct bound_table *table, double size, double grey);
