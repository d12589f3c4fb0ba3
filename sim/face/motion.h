/*
 * How the head moves: sway, nods, shakes and turns, all below 4 Hz; apart from what the face does.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "sim/face/script.h"
#include "sim/face/sines.h"

struct motion {
	bool still;
	struct pose rt_stage_seat; /* head coordinates of somebody who sits still */
	double turn_rad, turn_hz;  /* the large slow turn */
	double drift_scale[3];     /* of turn[], per head axis x, y, z */
	double shake_scale[3];     /* of shake[], radians */
	struct signal turn[3], shake[3], sway[3];
};

void motion_init(struct motion *motion, const struct sim_actor_script *script, uint64_t seed);

/* The head's pose; `turn_rad` to the subject's left comes on top. */
struct pose motion_head(const struct motion *motion, double time_s, double turn_rad);

/* The neck's: sways with the head and does not turn. */
struct pose motion_neck(const struct motion *motion, double time_s);
