/*
 * A scene's events as what they do to actors and to who sees them, at any scene time.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sim/face/face.h"
#include "sim/world/scene.h"

struct scene_actor;

/* An event whose names are found. */
struct happening {
	int kind;            /* enum sim_event_kind */
	uint32_t actor;      /* a passer's: in front of whom */
	double from_s, to_s; /* INFINITY: for good */
	double amount;
	int pose;                               /* of an expression */
	uint32_t marker;                        /* that falls off: of the actor's, face then body */
	uint64_t members[FACE_MARKER_MAX / 64]; /* of a group: bit m, face marker m */
	struct vec3 way;                        /* of a slip: unit, along the skull */
};

struct happenings {
	uint32_t count;
	struct happening list[SIM_EVENT_MAX];
};

/* Finds what the script's events speak of. Returns 0 or -EINVAL with a message for each name that
 * there is not. */
int happenings_init(struct happenings *happenings, const struct sim_script *script,
		    const struct scene_actor *actors, uint64_t seed, struct diag *diag);

/* An expression that is held takes the place of what the face does otherwise. */
void happenings_express(const struct happenings *happenings, uint32_t actor, double time_s,
			double weights[BASIS_COUNT]);

double happenings_turn_rad(const struct happenings *happenings, uint32_t actor, double time_s);

/* Where the head band sits; identity while it has not slipped. */
struct pose happenings_band(const struct happenings *happenings, uint32_t actor, double time_s);

/* How far a group moves a face marker along `way`, a unit vector on its skin. */
double happenings_micro_m(const struct happenings *happenings, uint32_t actor, uint32_t marker,
			  double time_s);

bool happenings_worn(const struct happenings *happenings, uint32_t actor, uint32_t marker,
		     double time_s);

/* Hands and passers. `rt_stage_neck`: of every actor. Returns how many there are now. */
uint32_t happenings_occluders(const struct happenings *happenings, const struct pose *rt_stage_neck,
			      double time_s, struct sim_truth_occluder *out, uint32_t room);
