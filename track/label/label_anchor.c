/*
 * A marker that comes back among others that are hidden still, as when a head turns back: names
 * that have held place it, and of the labels without a name no other could mean its point. So
 * nothing needs to be known of where its neighbours are hidden.
 */
#include "track/label/label.h"

#define HOLDING_MIN 3
#define NEAR_SHARE 0.3 /* of the distance to the next marker */
#define NEAR_SIGMA 3.5
#define SURE_SIGMA 2.5 /* from there to the next marker */
#define RIVAL_M 0.001
#define STRETCH 0.5 /* skin does not bring two markers nearer than by that share */

/* One that holds its name means another point; so does the one across lips or lids, if both are
 * seen, as their order tells them apart. There skin does not keep its distances. */
static bool is_rival(const struct labelling *l, const struct tracker_state *state, int label,
		     int other)
{
	const struct label_state *own = &state->labels[label], *its = &state->labels[other];
	const struct prediction *p = &l->predictions.labels[other];
	double reach_m = RIVAL_M + NEAR_SIGMA * p->sigma_m;
	bool across = label_order_tells(state, label, other);

	if (other == label || its->kind != LABEL_SKIN ||
	    (l->seen[other] && (across || l->motion.labels[other].recent)))
		return false;
	if (!across)
		reach_m = fmin(reach_m, STRETCH * vec3_distance(own->master_m, its->master_m));
	return vec3_distance(p->local_m, l->seen_m[label]) < reach_m;
}

/* Lips or lids that met and did not part yet as far as is known. */
static bool may_be_met(const struct labelling *l, const struct tracker_state *state, int label,
		       int other)
{
	return label_order_tells(state, label, other) && state->labels[other].doubted &&
	       !l->seen[other];
}

static bool has_rivals(const struct labelling *l, const struct tracker_state *state, int label)
{
	const struct frame_state *f = &state->frames[state->labels[label].frame];

	for (int i = f->label_first; i < f->label_end; i++)
		if (is_rival(l, state, label, i) || may_be_met(l, state, label, i))
			return true;
	return false;
}

/* Where its neighbours that hold their names have it, or its prediction, if there are enough of
 * them to trust that. */
static void ask_neighbours(const struct labelling *l, const struct tracker_state *state,
			   uint32_t label, struct vec3 *told_m, double *sigma_m)
{
	const struct label_state *own = &state->labels[label];
	const struct prediction *p = &l->predictions.labels[label];
	bool holds[LABEL_MAX] = {false};
	int count = 0;

	for (int k = 0; k < own->neighbour_count; k++) {
		int other = own->neighbours[k].label;

		holds[other] = label_holds_name(l, state, other);
		count += holds[other];
	}
	*sigma_m = INFINITY;
	if (count < HOLDING_MIN)
		return;
	predict_told(state, own, holds, l->seen_m, told_m, sigma_m);
	if (p->sigma_m < *sigma_m) {
		*told_m = p->local_m;
		*sigma_m = p->sigma_m;
	}
}

bool label_is_anchored(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	struct vec3 told_m;
	double sigma_m;

	if (own->kind != LABEL_SKIN)
		return false;
	ask_neighbours(l, state, label, &told_m, &sigma_m);
	if (expression_is_learned(state, own->actor))
		told_if_surer(&l->told[label], &told_m, &sigma_m);
	if (sigma_m == INFINITY)
		return false;
	double off_m = vec3_distance(told_m, l->seen_m[label]);
	return off_m <= NEAR_SHARE * own->spacing_m && off_m < NEAR_SIGMA * sigma_m &&
	       own->spacing_m - off_m >= SURE_SIGMA * sigma_m && !has_rivals(l, state, (int)label);
}
