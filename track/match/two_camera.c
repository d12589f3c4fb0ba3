/*
 * Markers that only two cameras see: nothing but the neighbours can contradict them, and left alone
 * they would drift off with a wrong blob.
 */
#include <math.h>

#include "track/label/remember.h"
#include "track/match/two_camera.h"

#define TWO_CAMERA_MIN_M 0.0015 /* how far from its prediction a two-camera marker may be */
#define TWO_CAMERA_SIGMAS 3.0
#define TWO_CAMERA_MAX_M 0.005
#define TWO_CAMERA_SHARE 0.45     /* ... of the distance to the next marker */
#define TWO_CAMERA_SIGMA_M 0.0025 /* who is expected more vaguely needs three */

/* Two cameras who outvoted a third are no more than two. */
static void drop_joined(struct labelling *l, const struct tracker_state *state,
			const struct matcher *matcher, uint32_t i)
{
	const struct point *point = &matcher->points[l->point_of_label[i]];

	if (point->fix.used_count != 2 || !two_camera_joins_in(l, state, i, point))
		return;
	l->point_of_label[i] = ASSIGN_NONE;
	l->seen[i] = false;
}

/* Whether only two cameras might tell where the label is. */
static bool is_missing(const struct labelling *l, const struct tracker_state *state, uint32_t i)
{
	const struct label_state *label = &state->labels[i];

	return l->found[label->frame] && l->assign.column_of_row[i] == ASSIGN_NONE &&
	       (label->kind != LABEL_SKIN ||
		l->predictions.labels[i].sigma_m <= TWO_CAMERA_SIGMA_M);
}

/* The pair that was added is the label's, or is given back. */
static void take(struct labelling *l, const struct tracker_state *state, struct matcher *matcher,
		 uint32_t i, int point)
{
	const struct point *found = &matcher->points[point];
	struct vec3 local_m =
		pose_apply(&l->rt_frame_stage[state->labels[i].frame], found->fix.p_stage_m);

	if (vec3_distance(local_m, l->predictions.labels[i].local_m) > TWO_CAMERA_MAX_M ||
	    !two_camera_is_it(l, state, matcher, i, found, local_m)) {
		match_give_back(matcher); /* nothing else confirms it */
		return;
	}
	l->point_of_label[i] = (int16_t)point;
	l->seen[i] = true;
	l->seen_m[i] = local_m;
}

/* A pair of blobs where the label is expected, if there is one. */
static void look_for(struct labelling *l, const struct tracker_state *state,
		     struct matcher *matcher, uint32_t i)
{
	const struct prediction *p = &l->predictions.labels[i];
	int frame = state->labels[i].frame;
	struct seed seed = {
		pose_apply(&l->rt_stage_frame[frame], p->local_m),
		fmin(fmax(TWO_CAMERA_MIN_M, TWO_CAMERA_SIGMAS * p->sigma_m),
		     fmin(TWO_CAMERA_MAX_M, TWO_CAMERA_SHARE * state->labels[i].spacing_m)),
		(int16_t)i, 0};
	int point = match_two_cameras(matcher, &seed);

	if (point >= 0)
		take(l, state, matcher, i, point);
}

/* Lips that move fast may lie farther from where they are expected; but where one of two that meet
 * is found, the other halves of its spots are the other's. */
static void look_across(struct labelling *l, const struct tracker_state *state,
			struct matcher *matcher, uint32_t i)
{
	const struct point *one = &matcher->points[l->point_of_label[i]];
	int other = one->is_pressed ? match_across(matcher, one) : LABEL_NONE, point;

	if (other == LABEL_NONE || l->point_of_label[other] != ASSIGN_NONE ||
	    !is_missing(l, state, (uint32_t)other))
		return;
	point = match_other_halves(matcher, l->point_of_label[i]);
	if (point >= 0)
		take(l, state, matcher, (uint32_t)other, point);
}

void remember_two_camera(struct labelling *l, const struct tracker_state *state,
			 struct matcher *matcher)
{
	for (uint32_t i = 0; i < state->label_count; i++) {
		if (l->point_of_label[i] != ASSIGN_NONE)
			drop_joined(l, state, matcher, i);
		if (is_missing(l, state, i))
			look_for(l, state, matcher, i);
	}
	for (uint32_t i = 0; i < state->label_count; i++)
		if (l->point_of_label[i] != ASSIGN_NONE)
			look_across(l, state, matcher, i);
}
