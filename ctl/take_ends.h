/*
 * For every actor of a take: is there a clean neutral at its start and at its end, and how far is
 * it from the layout's?
 */
#pragma once

#include <stdio.h>

#include "calib/actor/actor.h"
#include "track/observe.h"

struct take_ends;

struct take_ends *take_ends_create(const struct layout *layout); /* NULL: out of memory */
void take_ends_destroy(struct take_ends *ends);                  /* accepts NULL */
void take_ends_step(struct take_ends *ends, const struct marker_set *set);
/* One line an actor; the take is over. */
void take_ends_print(struct take_ends *ends, FILE *out);

/* An actor's markers as a set has them: those that are `first` .. `first + count`. */
void actor_shot_of_set(const struct marker_set *set, uint32_t actor, uint32_t first, uint32_t count,
		       struct actor_shot *out);
