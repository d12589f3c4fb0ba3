/*
 * Sines spread over the band, with random phases.
 */
#include "sim/face/sines.h"

#include <math.h>

struct signal signal_make(struct rng *rng, struct band band)
{
	struct signal signal;
	double sum = 0;

	for (int i = 0; i < SIGNAL_SINES; i++) {
		double place = (i + rng_uniform(rng)) / SIGNAL_SINES;

		signal.hz[i] = band.low_hz + (band.high_hz - band.low_hz) * place;
		signal.phase_rad[i] = 2.0 * M_PI * rng_uniform(rng);
		signal.amplitude[i] = 0.4 + rng_uniform(rng);
		sum += signal.amplitude[i];
	}
	for (int i = 0; i < SIGNAL_SINES; i++)
		signal.amplitude[i] /= sum;
	return signal;
}

double signal_at(const struct signal *signal, double time_s)
{
	double value = 0;

	for (int i = 0; i < SIGNAL_SINES; i++)
		value += signal->amplitude[i] *
			 sin(2.0 * M_PI * signal->hz[i] * time_s + signal->phase_rad[i]);
	return value;
}

/* SplitMix64 (Steele, Lea and Flood 2014). */
double signal_dice(uint64_t seed, uint64_t index)
{
	uint64_t z = seed + (index + 1) * UINT64_C(0x9e3779b97f4a7c15);

	z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
	return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}
