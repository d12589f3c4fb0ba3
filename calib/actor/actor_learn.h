/*
 * From what was captured to what is known of an actor: neutral, ranges, speeds, covariances and
 * which markers move together. Pure.
 */
#pragma once

#include "calib/actor/actor.h"

/* The robust mean of every marker: samples far from the median are left out. */
struct actor_neutral {
	uint32_t count;
	uint32_t shots[LABEL_MAX]; /* that the mean is of; 0 = not known */
	struct vec3 mean_m[LABEL_MAX];
	double sd_m[LABEL_MAX]; /* per axis */
};

/* Returns 0 or -ENOMEM. */
int actor_neutral_learn(const struct actor_part *part, struct actor_neutral *out);

/* Fills in `layout`, of one actor: neutral_m of what the neutral knows, but of body segments, and
 * `learned` of the face. `parts` are those of the script that were captured. */
void actor_learn(struct layout *layout, const struct actor_neutral *neutral,
		 const struct actor_part *parts, uint32_t part_count);
