/*
 * A camera should see a marker when it sees those about it. A face is neutral when it is still and
 * displaced from the layout by no more than what markers put on one by one are: what neighbours
 * share is an expression.
 */
#include "track/label/wear.h"

#define GONE_S 3.0
#define WATCH_MIN 3     /* of the nearest markers, in a camera that should see the one between */
#define SHARED_M 0.0035 /* nearer to another marker, it is merged with it and not absent */
#define STILL_M_S 0.02  /* mean speed of a still face's markers, noise included */
#define SHARED_MEAN_M 0.0015 /* of what neighbours share, over a neutral face */
#define SHARED_MAX_M 0.004
#define SEEN_SHARE 0.6 /* of a face's markers, to tell that it is neutral */
#define NEUTRAL_S 0.4
#define BASE_COUNT_MAX 100 /* shots that the day's neutral is learned from */
#define JIG_COUNT_MAX 60   /* ... and the shape of the rigid markers */

bool wear_is_gone(const struct label_state *label)
{
	return label->absent_s > GONE_S;
}

static int cameras_expected(const struct tracker_state *state, const struct labelling *l,
			    const struct point *points, uint32_t i)
{
	const struct label_state *label = &state->labels[i];
	uint32_t masks[WATCH_MAX];
	int count = 0, expected = 0;

	for (int k = 0; k < WATCH_MAX; k++) {
		int other = label->watch[k];

		if (other >= 0 && l->seen[other])
			masks[count++] = points[l->point_of_label[other]].fix.used_mask;
	}
	for (int c = 0; c < CAMERA_MAX && count >= WATCH_MIN; c++) {
		int see_it = 0;

		for (int k = 0; k < count; k++)
			see_it += masks[k] >> c & 1;
		expected += see_it >= WATCH_MIN;
	}
	return expected;
}

static bool is_merged(const struct tracker_state *state, const struct labelling *l, uint32_t i)
{
	double distance2_m2;
	int frame = state->labels[i].frame;
	struct vec3 where_m =
		pose_apply(&l->rt_stage_frame[frame], l->predictions.labels[i].local_m);

	return nearby_nearest(&l->nearby, where_m, SHARED_M, &distance2_m2) >= 0;
}

static void watch_absent(struct tracker_state *state, const struct labelling *l,
			 const struct point *points, double dt_s)
{
	for (uint32_t i = 0; i < state->label_count; i++) {
		struct label_state *label = &state->labels[i];

		if (!l->found[label->frame])
			continue;
		if (l->seen[i] && points[l->point_of_label[i]].label == (int16_t)i)
			label->absent_s = 0;
		else if (!is_merged(state, l, i) && cameras_expected(state, l, points, i) >= 3)
			label->absent_s += dt_s;
	}
}

/* What the label's neighbours share of displacement from the layout. False when few are seen. */
static bool shared_displacement(const struct tracker_state *state, const struct labelling *l,
				const struct label_state *label, double *shared_m)
{
	struct vec3 sum = {0, 0, 0};
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		int other = label->neighbours[k].label;

		if (!l->seen[other])
			continue;
		sum = vec3_add(sum, vec3_sub(l->seen_m[other], state->labels[other].master_m));
		count++;
	}
	if (count < 4)
		return false;
	*shared_m = vec3_norm(sum) / count;
	return true;
}

static bool is_neutral(const struct tracker_state *state, const struct labelling *l, int actor)
{
	const struct frame_state *f = &state->frames[actor];
	double speed_m_s = 0, sum_m = 0, most_m = 0, shared_m;
	int skin = 0, told = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		skin += label->kind == LABEL_SKIN;
		if (label->kind != LABEL_SKIN || !l->seen[i] ||
		    !shared_displacement(state, l, label, &shared_m))
			continue;
		told++;
		speed_m_s += vec3_norm(label->velocity_m_s);
		sum_m += shared_m;
		most_m = fmax(most_m, shared_m);
	}
	return told > 0 && told >= SEEN_SHARE * skin && speed_m_s < STILL_M_S * told &&
	       sum_m < SHARED_MEAN_M * told && most_m < SHARED_MAX_M;
}

static void learn_base(struct label_state *label, struct vec3 seen_m, uint32_t count_max)
{
	if (label->base_count >= count_max)
		return;
	struct vec3 before = label->base_count ? label->base_m : seen_m;
	struct vec3 off = vec3_sub(seen_m, before);

	label->base_count++;
	label->base_m = vec3_add(before, vec3_scale(off, 1.0 / label->base_count));
}

/* The skin is learned in the day's first neutral, the jig's shape from the first shots. */
static void learn_actor(struct tracker_state *state, const struct labelling *l,
			const struct point *points, int actor, double dt_s)
{
	const struct frame_state *f = &state->frames[actor];
	struct face_state *face = &state->faces[actor];

	face->still_s = is_neutral(state, l, actor) ? face->still_s + dt_s : 0;
	face->neutral_known |= face->still_s > NEUTRAL_S;
	for (int i = f->label_first; i < f->label_end; i++) {
		struct label_state *label = &state->labels[i];

		if (!l->seen[i] || points[l->point_of_label[i]].label != i ||
		    points[l->point_of_label[i]].fix.used_count < 3)
			continue;
		if (label->kind == LABEL_SKULL)
			learn_base(label, l->seen_m[i], JIG_COUNT_MAX);
		if (label->kind == LABEL_SKIN && face->still_s > NEUTRAL_S)
			learn_base(label, l->seen_m[i], BASE_COUNT_MAX);
	}
}

void wear_learn(struct tracker_state *state, const struct labelling *l, const struct point *points,
		const bool *anchored, double dt_s)
{
	watch_absent(state, l, points, dt_s);
	for (uint32_t a = 0; a < state->actor_count; a++) {
		if (l->found[a] && anchored[a])
			learn_actor(state, l, points, (int)a, dt_s);
		else
			state->faces[a].still_s = 0;
	}
}
