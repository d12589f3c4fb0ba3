/*
 * What a shot leaves over in pairs: a label that found no point where it was expected, and a point
 * of no label not far from there. A jaw that sets off at once leaves such pairs; a neighbourhood
 * that is read one marker aside leaves label and point a whole spacing apart.
 */
#include "track/label/label.h"

#define PAIR_SHARE 0.45 /* of the distance to the next marker */
#define PAIR_MAX_M 0.007
#define ALONE_SHARE 1.6 /* every other label is expected so many times as far from the point */
#define TELLERS_MIN 3   /* neighbours: fewer say nothing */
#define TOLD_MIN_M 0.0015
#define TOLD_SIGMA 2.0 /* ... and so many of theirs: no farther from where it is told to be */

static bool is_left_over(const struct labelling *l, const struct tracker_state *state, int row)
{
	const struct label_state *label = &state->labels[row];

	return label->kind == LABEL_SKIN && label->confirmed && l->found[label->frame] &&
	       !l->motion.fresh[label->frame] && l->assign.column_of_row[row] == ASSIGN_NONE;
}

/* The nearest point of no label within reach, or -1. */
static int nearest_left_over(const struct labelling *l, struct vec3 expected_m, double diameter_m,
			     double *reach_m)
{
	const struct nearby *n = &l->nearby;
	int nearest = -1;

	for (int k = nearby_from(n, expected_m.x - *reach_m);
	     k < n->count && n->p_stage_m[k].x <= expected_m.x + *reach_m; k++) {
		double distance_m = vec3_distance(n->p_stage_m[k], expected_m);

		if (distance_m >= *reach_m || l->is_ghost[n->point[k]] ||
		    l->is_strained[n->point[k]] ||
		    l->assign.row_of_column[n->point[k]] != ASSIGN_NONE ||
		    !point_size_fits(&l->sizes[n->point[k]], diameter_m))
			continue;
		*reach_m = distance_m;
		nearest = k;
	}
	return nearest;
}

/* No other label of the frame could mean the point. */
static bool is_meant_by_one(const struct labelling *l, const struct tracker_state *state, int row,
			    struct vec3 p_stage_m, double distance_m)
{
	int16_t frame = state->labels[row].frame;
	const struct frame_state *f = &state->frames[frame];

	for (int i = f->label_first; i < f->label_end; i++)
		if (i != row && state->labels[i].frame == frame &&
		    vec3_distance(l->expected_m[i], p_stage_m) < ALONE_SHARE * distance_m)
			return false;
	return true;
}

/* A light that appears while the marker is hidden or merged does not lie where the neighbours have
 * that, or the whole face, whichever is surer. */
static bool is_told_there(const struct labelling *l, const struct tracker_state *state, int row,
			  struct vec3 p_stage_m)
{
	const struct label_state *label = &state->labels[row];
	struct vec3 local_m = pose_apply(&l->rt_frame_stage[label->frame], p_stage_m), told_m;
	double sigma_m;

	if (!l->motion.labels[row].recent ||
	    predict_told(state, label, l->seen, l->seen_m, &told_m, &sigma_m) < TELLERS_MIN)
		return true;
	told_if_surer(&l->told[row], &told_m, &sigma_m);
	return vec3_distance(told_m, local_m) < TOLD_MIN_M + TOLD_SIGMA * sigma_m;
}

void label_pair_left_over(struct labelling *l, const struct tracker_state *state)
{
	for (int row = 0; row < l->assign.row_count; row++) {
		if (!is_left_over(l, state, row))
			continue;
		double reach_m = fmin(PAIR_SHARE * state->labels[row].spacing_m, PAIR_MAX_M);
		int k = nearest_left_over(l, l->expected_m[row], state->labels[row].diameter_m,
					  &reach_m);

		if (k < 0 || !is_meant_by_one(l, state, row, l->nearby.p_stage_m[k], reach_m) ||
		    !is_told_there(l, state, row, l->nearby.p_stage_m[k]))
			continue;
		l->assign.column_of_row[row] = l->nearby.point[k];
		l->assign.row_of_column[l->nearby.point[k]] = (int16_t)row;
	}
}
