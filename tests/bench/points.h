/*
 * What the parts of bench-points share; each adds its figures to one JSON object.
 */
#pragma once

#include <jansson.h>
#include <stdint.h>

struct points_bench {
	uint64_t seed;
	int effort; /* 1: quick and coarse; more: as many times the trials */
	json_t *figures;
};

/* Triangulated points against the Cramer-Rao bound and against an oracle, and their covariances. */
void bench_fixes(struct points_bench *bench);

/* CPU of the tracker per shot, and of matching alone in a room of many cameras and actors. */
void bench_solve(struct points_bench *bench);

/* Allan deviation of a marker that stands still. */
void bench_still(struct points_bench *bench);
