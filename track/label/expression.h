/*
 * What a face does as a few patterns: the displacements of all its markers from the layout are sums
 * of patterns, learned while it is watched. The markers that are seen tell how much of each there
 * is, and that tells where the hidden ones are. (Principal components with missing data: Roweis
 * 1998, Tipping and Bishop 1999; each marker's row by least squares in which the past fades: Chi,
 * Eldar and Calderbank 2013.) Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/tracker_state.h"

#define EXPRESSION_LEARNED_S 2.0 /* of watching a face */

/* It was watched for long enough that the face as a whole may tell names. */
static inline bool expression_is_learned(const struct tracker_state *state, int actor)
{
	return state->expressions[actor].learned_s > EXPRESSION_LEARNED_S;
}

/* How much of each pattern there is in one shot. */
struct expression {
	bool known;
	int count;
	float amount[PATTERN_MAX];              /* the first is 1 */
	float spread[PATTERN_MAX][PATTERN_MAX]; /* covariance: of two patterns, the product of their
						   rows */
};

/* What an opening jaw does is known before anything is seen. */
void expression_init(struct tracker_state *state, int actor);

/* From the markers in `tells`, whose places in the head are `seen_m`. Too few of them: not known.
 */
void expression_solve(const struct tracker_state *state, int actor, int64_t now_ns,
		      const bool *tells, const struct vec3 *seen_m, struct expression *out);

/* Where a face has a marker that does not tell itself. */
struct told {
	bool known;
	struct vec3 local_m; /* in the head */
	double sigma_m;      /* per axis */
};

/* Where the whole face tells better where a marker is, it does. */
static inline void told_if_surer(const struct told *told, struct vec3 *local_m, double *sigma_m)
{
	if (!told->known || told->sigma_m >= *sigma_m)
		return;
	*local_m = told->local_m;
	*sigma_m = told->sigma_m;
}

/* Fills those of the actor's labels; known: skin, not in `tells`. */
void expression_tell(const struct tracker_state *state, int actor,
		     const struct expression *expression, const bool *tells, struct told *out);

/* Learns from the markers in `sure` how they lie when the face does what `now` says; once in a
 * while suffices, so that many calls do little. */
void expression_learn(struct tracker_state *state, int actor, const struct expression *now,
		      int64_t now_ns, double dt_s, const bool *sure, const struct vec3 *seen_m);
