/*
 * A band-limited signal as a sum of sines, so that any instant can be asked for.
 */
#pragma once

#include "base/rng.h"

#define SIGNAL_SINES 3

struct band {
	double low_hz, high_hz;
};

/* Within [-1, 1]. */
struct signal {
	double amplitude[SIGNAL_SINES], hz[SIGNAL_SINES], phase_rad[SIGNAL_SINES];
};

struct signal signal_make(struct rng *rng, struct band band);
double signal_at(const struct signal *signal, double time_s);

/* A number of [0, 1) for each index of a seeded sequence, in any order. */
double signal_dice(uint64_t seed, uint64_t index);
