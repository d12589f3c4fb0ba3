/*
 * The parts of the blob bench; each adds its figures to an object.
 */
#pragma once

#include <jansson.h>
#include <stdint.h>

#define BENCH_READ_NOISE 2
#define BENCH_ELECTRONS_PER_GREY 40
#define BENCH_BACKGROUND 10

struct blobs_bench {
	uint64_t seed;
	int effort; /* rounds and pictures are multiples of it */
	int spot_count;
	double diameter_px;
	json_t *figures;
};

/* Time over plainly reading the frames, and OpenCV's over ours. Returns 0 or a negative errno. */
int bench_times(struct blobs_bench *bench);

/* Centroids against the bound; each with two unlike models of a spot, of which the worse counts. */
void bench_centroids(struct blobs_bench *bench);
