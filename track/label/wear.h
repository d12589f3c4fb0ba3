/*
 * How an actor wears the markers today: those that have fallen off, and where the others sit, which
 * is some way from where the layout has them when they were put on anew. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

/* Learns from one shot; `anchored` says which heads three rigid markers hold. */
void wear_learn(struct tracker_state *state, const struct labelling *labelling,
		const struct point *points, const bool *anchored, double dt_s);

/* The marker has fallen off: for long cameras should have seen it that see all about it. */
bool wear_is_gone(const struct label_state *label);
