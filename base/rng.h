/*
 * Deterministic random numbers for the simulator and the tests: PCG32 (O'Neill 2014).
 * The same seed and stream give the same numbers on every machine.
 */
#pragma once

#include <stdint.h>

struct rng {
	uint64_t state;
	uint64_t increment;
};

void rng_init(struct rng *rng, uint64_t seed, uint64_t stream);
uint32_t rng_u32(struct rng *rng);
double rng_uniform(struct rng *rng); /* [0, 1) */
double rng_normal(struct rng *rng);  /* mean 0, variance 1 */
