/*
 * Has the jig that carries a head's rigid markers slipped on the skull? It is as rigid as before:
 * only the skin tells, when all of it seems to have moved as one. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

/* Watches one shot of a head that three rigid markers hold. When the jig has slipped for long
 * enough, its markers' places and all that is known in head coordinates are moved, so that the head
 * is the skull again. While the skin seems to have moved as one, slipping_s of the face is not 0,
 * and nothing about where it rests should be learned. */
void jig_watch(struct tracker_state *state, const struct labelling *labelling, int actor,
	       double dt_s);
