/*
 * The calibration of an actor: what his markers do at rest and over the range of motion of his
 * face. Pure of files, clocks and devices. Everything is in the coordinates of the actor's head, as
 * the tracker's stabilised layer has it.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/layout.h"

/* The actor's markers in one shot. */
struct actor_shot {
	int64_t mid_exposure_ns;
	bool head_found;
	uint32_t count;       /* the actor's markers, in the layout's order */
	bool seen[LABEL_MAX]; /* measured by three cameras, under a sure name */
	struct vec3 p_m[LABEL_MAX];
};

/* One part of the script as it was captured: shots in the order of their times, at most
 * ACTOR_RATE_HZ of them a second. */
struct actor_part {
	uint32_t marker_count, shot_count, shot_max;
	int64_t *time_ns; /* [shot_count]; owned, as the places */
	struct vec3 *p_m; /* [shot_count][marker_count]; x is NAN where it was not seen */
};

#define ACTOR_RATE_HZ 30.0

void actor_part_finish(struct actor_part *part); /* a zeroed one is fine */
void actor_part_clear(struct actor_part *part);  /* keeps the memory for the next */

/* Adds a shot, unless one was added less than a 30th of a second before. Returns 0 or -ENOMEM. */
int actor_part_add(struct actor_part *part, const struct actor_shot *shot);

/* The markers of one actor out of a layout of several, numbered from 0. */
void actor_layout(const struct layout *all, uint32_t actor, struct layout *out);
