/*
 * How well the tracker did against the truth of a scene. Truth meets tracker only here.
 */
#pragma once

#include <stdint.h>

#include "sim/scene.h"
#include "track/observe.h"

#define SCORE_NEAR_M 0.003 /* a marker this near to a true one is that one */

struct score {
	uint64_t shots;
	uint64_t seen3;    /* true markers that three or more cameras see */
	uint64_t right;    /* of those, named right */
	uint64_t unnamed;  /* of those, without a name or missing */
	uint64_t wrong;    /* measured under a name whose true marker is not there */
	uint64_t measured; /* named, measured, three or more views */
	uint64_t stray;    /* points without a name that are no true marker */
	uint64_t two_right, two_wrong;
	uint64_t predicted;
	double error2_m2; /* sum over right ones */
	double predicted2_m2;
	double nees;           /* sum over right ones, three degrees of freedom each */
	double head_error2_m2; /* of a point on the face */
	uint64_t heads;
	int64_t first_named_shot; /* first shot with nine in ten named right; -1 = none yet */
};

void score_init(struct score *score);
void score_shot(struct score *score, const struct sim_truth *truth, const struct marker_set *set);
