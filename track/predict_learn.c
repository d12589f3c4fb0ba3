/*
 * Learns from shot to shot how alike neighbours move, and where each marker rests.
 */
#include "track/predict.h"
#include "track/predict_parts.h"

#define RISE_S 0.05
#define FALL_S 10.0
/* In seconds of such a displacement: that both move alike. */
#define GAIN_PRIOR_M2 (0.003 * 0.003)
#define GAIN_MAX 2.5
#define PRIOR_S 0.3 /* what the priors are worth */

/* Shares of what is new in what is learned. A mean square rises at once and falls slowly: a face at
 * rest for a while must not make what follows look impossible. At first the prior soon gives way.
 */
struct pace {
	double dt_s, rise, fall;
	double kept; /* of a sum that fades */
};

static struct pace pace_of(const struct label_state *label, double dt_s)
{
	return (struct pace){dt_s, fmin(dt_s / RISE_S, 1),
			     fmin(dt_s / fmin(FALL_S, PRIOR_S + label->learned_s), 1),
			     1 - fmin(dt_s / FALL_S, 1)};
}

static void learn_mean(double *mean, double now, struct pace pace)
{
	*mean += (now - *mean) * (now > *mean ? pace.rise : pace.fall);
}

/* Least squares through the origin, in which what was long ago fades. */
static void learn_gain(struct neighbour *neighbour, struct vec3 own, struct vec3 its,
		       struct pace pace)
{
	neighbour->both_m2 = pace.kept * neighbour->both_m2 + pace.dt_s * vec3_dot(own, its);
	neighbour->its_m2 = pace.kept * neighbour->its_m2 + pace.dt_s * vec3_dot(its, its);
	double gain = (neighbour->both_m2 + GAIN_PRIOR_M2) / (neighbour->its_m2 + GAIN_PRIOR_M2);
	neighbour->gain = gain > 0 ? gain < GAIN_MAX ? gain : GAIN_MAX : 0;
}

static void learn_spread(struct label_state *label, struct vec3 own, struct pace pace,
			 const bool *seen, const struct vec3 *moved_m)
{
	for (int k = 0; k < label->neighbour_count; k++) {
		struct neighbour *neighbour = &label->neighbours[k];

		if (!seen[neighbour->label])
			continue;
		struct vec3 its = moved_m[neighbour->label];
		struct vec3 apart = vec3_sub(own, vec3_scale(its, neighbour->gain));
		double left_m2 = vec3_dot(apart, apart);
		left_m2 = left_m2 > SPREAD_MIN_M2 ? left_m2 : SPREAD_MIN_M2;
		learn_mean(&neighbour->leaves, left_m2 / (vec3_dot(its, its) + SMALL_M2), pace);
		learn_gain(neighbour, own, its, pace);
	}
}

static void learn_rest(struct label_state *label, struct pace pace, struct vec3 seen_m)
{
	struct vec3 off = vec3_sub(seen_m, label->rest_m);

	learn_mean(&label->rest_variance_m2, vec3_dot(off, off), pace);
	label->rest_m = vec3_add(label->rest_m, vec3_scale(off, pace.fall));
}

void predict_learn(struct tracker_state *state, double dt_s, const bool *anchored, const bool *seen,
		   const struct vec3 *seen_m)
{
	struct vec3 moved_m[LABEL_MAX];

	for (uint32_t i = 0; i < state->label_count; i++)
		if (seen[i])
			moved_m[i] = vec3_sub(seen_m[i], state->labels[i].base_m);
	for (uint32_t i = 0; i < state->label_count; i++) {
		struct label_state *label = &state->labels[i];

		if (!seen[i] || label->kind != LABEL_SKIN)
			continue;
		label->learned_s += dt_s;
		struct pace pace = pace_of(label, dt_s);
		learn_spread(label, moved_m[i], pace, seen, moved_m);
		if (anchored[label->actor] && state->faces[label->actor].slipping_s == 0)
			learn_rest(label, pace, seen_m[i]);
	}
}
