/*
 * How the head and the face move: sums of sines below 4 Hz, so that any instant can be asked for.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "sim/face.h"

#define MOTION_SINES 3

/* Band-limited, within [-1, 1]. */
struct signal {
	double amplitude[MOTION_SINES], hz[MOTION_SINES], phase_rad[MOTION_SINES];
};

struct motion {
	bool still; /* scene "rest": nothing moves */
	struct signal expressions[EXPRESSION_COUNT];
	double expression_scale[EXPRESSION_COUNT];
	struct vec3 seat_m;                       /* of the head's middle, stage coordinates */
	struct vec3 seat_turn_rad;                /* small, head coordinates */
	double turn_rad, turn_hz, turn_phase_rad; /* scene "turning": the large slow turn */
	struct signal turn[3], shake[3], sway[3]; /* per head axis x, y, z */
};

/* `performance` is an enum sim_performance. */
void motion_init(struct motion *motion, int performance, uint64_t seed);

void motion_expressions(const struct motion *motion, double time_s,
			double weights[EXPRESSION_COUNT]);
struct pose motion_head(const struct motion *motion, double time_s);
