/*
 * A nameless point that comes back to the same place of the stage or of a head, shot after shot. A
 * place that is never seen again makes room for another.
 */
#include "track/ghost.h"

#include "track/label/wear.h"

#define NEAR_M 0.003      /* of the place where it was */
#define HEAD_REACH_M 0.18 /* a ghost this near to a head may be of it */
#define KNOWN_S 0.5       /* seen for so long in all, it is known */
#define SEEN_MAX_S 5.0
#define FORGET 0.02      /* seconds of sight lost for each second unseen ... */
#define FORGET_NEW 0.2   /* ... and while it is not known yet */
#define LOST_SHARE 0.2   /* of a sight, while an actor is not found */
#define FOLLOW 0.1       /* share of a new sight in the place */
#define EXPECTED_M 0.005 /* a missing label may be so near to where it is expected ... */
#define ANYWHERE_M 0.035 /* ... or so, while it has no name: faces are found with open mouths */

static struct vec3 place_of(const struct ghost *ghost, const struct labelling *l)
{
	return ghost->frame < 0 ? ghost->p_m
				: pose_apply(&l->rt_stage_frame[ghost->frame], ghost->p_m);
}

static bool can_tell(const struct ghost *ghost, const struct labelling *l)
{
	return ghost->seen_s > 0 && (ghost->frame < 0 || l->found[ghost->frame]);
}

void ghost_recognise(const struct tracker_state *state, const struct labelling *l,
		     const struct point *points, uint32_t point_count, bool *is_ghost)
{
	for (uint32_t p = 0; p < point_count; p++)
		is_ghost[p] = false;
	for (int g = 0; g < GHOST_MAX; g++) {
		const struct ghost *ghost = &state->ghosts[g];

		if (ghost->seen_s < KNOWN_S || !can_tell(ghost, l))
			continue;
		struct vec3 place_m = place_of(ghost, l);
		for (uint32_t p = 0; p < point_count; p++)
			is_ghost[p] |= vec3_distance(points[p].fix.p_stage_m, place_m) < NEAR_M;
	}
}

static double reach_m(const struct label_state *label)
{
	return label->kind != LABEL_SKIN || label->confirmed || wear_is_gone(label) ? EXPECTED_M
										    : ANYWHERE_M;
}

/* A label without a point may be this one. */
static bool may_be_label(const struct tracker_state *state, const struct labelling *l,
			 struct vec3 p_stage_m)
{
	for (uint32_t i = 0; i < state->label_count; i++)
		if (!l->seen[i] && l->found[state->labels[i].frame] &&
		    vec3_distance(p_stage_m, pose_apply(&l->rt_stage_frame[state->labels[i].frame],
							l->predictions.labels[i].local_m)) <
			    reach_m(&state->labels[i]))
			return true;
	return false;
}

/* Of the free places the one seen least, if it is seen less than this new one would be. */
static void add_ghost(struct tracker_state *state, int16_t frame, struct vec3 p_m, double dt_s)
{
	struct ghost *least = &state->ghosts[0];

	for (int g = 1; g < GHOST_MAX; g++)
		if (state->ghosts[g].seen_s < least->seen_s)
			least = &state->ghosts[g];
	if (least->seen_s < dt_s)
		*least = (struct ghost){frame, true, dt_s, p_m};
}

/* The same light is tried as one of the stage and of every head nearby; where it does not stand
 * still, it is soon forgotten. */
static void note_in_frame(struct tracker_state *state, const struct labelling *l, int16_t frame,
			  struct vec3 p_stage_m, double dt_s)
{
	struct vec3 p_m = frame < 0 ? p_stage_m : pose_apply(&l->rt_frame_stage[frame], p_stage_m);

	for (int g = 0; g < GHOST_MAX; g++) {
		struct ghost *ghost = &state->ghosts[g];

		if (ghost->seen_s <= 0 || ghost->frame != frame ||
		    vec3_distance(ghost->p_m, p_m) >= NEAR_M)
			continue;
		if (!ghost->seen_now)
			ghost->seen_s = fmin(ghost->seen_s + dt_s, SEEN_MAX_S);
		ghost->seen_now = true;
		ghost->p_m = vec3_add(ghost->p_m, vec3_scale(vec3_sub(p_m, ghost->p_m), FOLLOW));
		return;
	}
	add_ghost(state, frame, p_m, dt_s);
}

/* Points of an actor who is not found yet may stand still for a while. */
static double worth(const struct tracker_state *state, const struct labelling *l)
{
	for (uint32_t a = 0; a < state->actor_count; a++)
		if (!l->found[a])
			return LOST_SHARE;
	return 1;
}

void ghost_learn(struct tracker_state *state, const struct labelling *l, const struct point *points,
		 uint32_t point_count, double dt_s)
{
	dt_s *= worth(state, l);
	for (int g = 0; g < GHOST_MAX; g++)
		state->ghosts[g].seen_now = false;
	for (uint32_t p = 0; p < point_count; p++) {
		struct vec3 p_stage_m = points[p].fix.p_stage_m;

		if (points[p].label != LABEL_NONE || points[p].fix.used_count < 3 ||
		    may_be_label(state, l, p_stage_m))
			continue;
		note_in_frame(state, l, -1, p_stage_m, dt_s);
		for (uint32_t a = 0; a < state->actor_count; a++)
			if (l->found[a] &&
			    vec3_distance(l->rt_stage_frame[a].t, p_stage_m) < HEAD_REACH_M)
				note_in_frame(state, l, (int16_t)a, p_stage_m, dt_s);
	}
	for (int g = 0; g < GHOST_MAX; g++) {
		struct ghost *ghost = &state->ghosts[g];

		if (!ghost->seen_now)
			ghost->seen_s -= (ghost->seen_s < KNOWN_S ? FORGET_NEW : FORGET) * dt_s;
	}
}
