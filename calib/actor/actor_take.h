/*
 * The clean neutral at the start and at the end of a take, if there is one: the first and the last
 * rest long enough in which the face is neutral, near enough to the take's ends. Pure.
 */
#pragma once

#include "calib/actor/actor_rest.h"

#define TAKE_NEUTRAL_S 0.4 /* how long the face must rest */
#define TAKE_END_S 15.0    /* so near to an end, and in its own half of the take */

struct take_neutral {
	bool found;
	int64_t begin_ns, end_ns;
	struct actor_neutral_fit fit;
};

struct actor_take {
	const struct layout *layout; /* of the actor alone; borrowed */
	struct actor_rest_finder finder;
	struct actor_rest ended; /* room for the last rest */
	int64_t first_ns, last_ns;
	uint64_t shots, shots_with_head;
	struct take_neutral start, end;
};

void actor_take_begin(struct actor_take *take, const struct layout *layout);
void actor_take_step(struct actor_take *take, const struct actor_shot *shot);
/* Decides at the take's end: `start` and `end` are final then. */
void actor_take_end(struct actor_take *take);
