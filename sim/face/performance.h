/*
 * What the face does over time, as weights of its bases: speech with pauses, mimic and blinks, or
 * the poses of an actor calibration. Below 4 Hz, as good as blinks and pauses allow.
 */
#pragma once

#include <stdint.h>

#include "sim/face/face.h"
#include "sim/face/script.h"
#include "sim/face/sines.h"

#define PERFORMANCE_POSE_S 2.0 /* of the range of motion: one pose, there and back */
#define PERFORMANCE_ACTIONS 5

struct performance {
	int kind;      /* enum sim_performance */
	uint64_t dice; /* seed of what happens when */
	double seconds, neutral_start_s, neutral_end_s;
	double jaw_gain;                  /* weight of the jaw when it is widest open */
	double shape_gain;                /* of everything else, up to 1 */
	int actions[PERFORMANCE_ACTIONS]; /* poses */
	struct signal jaw, jaw_side, smile, snarl, brow[2], frown;
};

/* The fastest marker of `face` comes to script->face_speed_m_s within a take. */
void performance_init(struct performance *performance, const struct sim_actor_script *script,
		      const struct face *face, double seconds, uint64_t seed);

void performance_weights(const struct performance *performance, double time_s,
			 double weights[BASIS_COUNT]);
