/*
 * Finds out when a face is at rest, and whether that rest is neutral: shot after shot goes in, and
 * runs of rest come out with the mean place of every marker. Pure; state without pointers.
 */
#pragma once

#include "calib/actor/actor.h"

/* A stretch of time in which nearly all markers stood still. */
struct actor_rest {
	int64_t begin_ns, end_ns;
	uint32_t count;            /* of markers */
	uint32_t shots[LABEL_MAX]; /* that each mean is of; 0 = not seen */
	struct vec3 mean_m[LABEL_MAX];
};

struct actor_rest_finder {
	struct actor_rest run;   /* grows while the face rests; begin_ns 0 = none */
	struct actor_rest block; /* the last tenth of a second */
	uint32_t block_shots;
};

void actor_rest_begin(struct actor_rest_finder *finder);

/* Takes a shot. True: what follows differs, and `ended` is the rest that was before it, however
 * short. Shots without a head end a rest. */
bool actor_rest_step(struct actor_rest_finder *finder, const struct actor_shot *shot,
		     struct actor_rest *ended);

double actor_rest_s(const struct actor_rest *rest);

/* How a rest lies to the neutral of the layout (of one actor). */
struct actor_neutral_fit {
	uint32_t markers, unseen; /* on the face, and those of them never seen in the rest */
	uint32_t far;             /* farther than ACTOR_FAR_M from the layout */
	double residual_m;        /* rms over the face */
	double shared_m; /* mean of what neighbours share: an expression moves them alike, markers
			    that were put on anew do not */
	double shared_max_m;
	bool is_neutral;
};

#define ACTOR_FAR_M 0.005

struct actor_neutral_fit actor_rest_fit(const struct actor_rest *rest, const struct layout *layout);
