/*
 * How far the jaw is open, before any name below the mouth is known: one number that lays the lower
 * face of the layout on the points. Pure and real-time safe.
 */
#pragma once

#include "track/label/label.h"

/* What an open jaw does to the labels of an actor; nothing where the layout has no groups named
 * upper and lower for the lips. */
void jaw_init(struct tracker_state *state, const struct layout *layout, int actor);

/* Where names are missing below a mouth: fits the jaw to the shot's points and leans the labels,
 * and what is expected of those without a name, by it. Elsewhere nothing leans. */
void jaw_lean(struct tracker_state *state, struct labelling *labelling);
