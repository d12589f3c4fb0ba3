/*
 * PCG32, uniform by 32 bits, normal by Box-Muller (one of the pair; no hidden state).
 */
#include "base/rng.h"

#include <math.h>

void rng_init(struct rng *rng, uint64_t seed, uint64_t stream)
{
	rng->state = 0;
	rng->increment = (stream << 1) | 1;
	rng_u32(rng);
	rng->state += seed;
	rng_u32(rng);
}

uint32_t rng_u32(struct rng *rng)
{
	uint64_t old = rng->state;
	uint32_t mixed = (uint32_t)(((old >> 18) ^ old) >> 27);
	uint32_t turn = (uint32_t)(old >> 59);

	rng->state = old * UINT64_C(6364136223846793005) + rng->increment;
	return (mixed >> turn) | (mixed << ((32 - turn) & 31));
}

double rng_uniform(struct rng *rng)
{
	return rng_u32(rng) * 0x1p-32;
}

double rng_normal(struct rng *rng)
{
	double radius = sqrt(-2.0 * log(1.0 - rng_uniform(rng)));

	return radius * cos(2.0 * M_PI * rng_uniform(rng));
}
