/*
 * Lights that are no markers and stand still, on the stage (lamps) or on a head (teeth, eyes): they
 * are learned, so that they are named and no longer cast doubt on the names about them. Pure and
 * real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

/* Says of every point whether it lies where a ghost is known. */
void ghost_recognise(const struct tracker_state *state, const struct labelling *labelling,
		     const struct point *points, uint32_t point_count, bool *is_ghost);

/* Learns from the points that got no name and that no missing label explains. */
void ghost_learn(struct tracker_state *state, const struct labelling *labelling,
		 const struct point *points, uint32_t point_count, double dt_s);
