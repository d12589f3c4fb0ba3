/*
 * The pose that takes the skin's resting places to where it is now, robustly (Geman-McClure): an
 * expression moves some of it, and not as one; a slip moves all.
 */
#include "track/jig.h"

#include "track/head.h"
#include "track/rigid.h"

#define LEARNED_MIN_S 2.0 /* a resting place that is known for shorter tells nothing */
#define SKIN_MIN 12
#define ROUNDS 4
#define ROBUST_M 0.002
#define SLIP_M 0.0012     /* a shorter one is not told from an expression */
#define AS_ONE_SHARE 0.5  /* of the skin's typical displacement may be left without the slip */
#define SLIP_S 0.5        /* it must hold so long */
#define SURE_SLIP_M 0.002 /* a longer one is believed the sooner ... */
#define SURE_SLIP_S 0.15  /* ... after so long at least */
#define SMOOTH_S 0.1

struct skin {
	int count;
	struct rigid_pair pairs[LABEL_MAX]; /* from rest to now, head coordinates */
	double sigma_m[LABEL_MAX];
};

static void collect(const struct tracker_state *state, const struct labelling *l, int actor,
		    struct skin *skin)
{
	const struct frame_state *f = &state->frames[actor];

	skin->count = 0;
	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		if (label->kind != LABEL_SKIN || !l->seen[i] || label->learned_s < LEARNED_MIN_S)
			continue;
		skin->sigma_m[skin->count] = sqrt(label->rest_variance_m2) + 0.0005;
		skin->pairs[skin->count++] = (struct rigid_pair){label->rest_m, l->seen_m[i], 1};
	}
}

/* The middle one of the distances under a pose, by counting: no sort. */
static double median_error_m(const struct skin *skin, const struct pose *pose)
{
	double low = 0, high = 0.1, error_m[LABEL_MAX];

	for (int i = 0; i < skin->count; i++)
		error_m[i] = rigid_error(&skin->pairs[i], pose);
	for (int step = 0; step < 12; step++) {
		double middle = 0.5 * (low + high);
		int below = 0;

		for (int i = 0; i < skin->count; i++)
			below += error_m[i] < middle;
		if (2 * below < skin->count)
			low = middle;
		else
			high = middle;
	}
	return high;
}

static bool fit(struct skin *skin, struct pose *pose)
{
	*pose = POSE_IDENTITY;
	for (int round = 0; round < ROUNDS; round++) {
		double wide = round == 0 ? 4 : round == 1 ? 2 : 1;

		for (int i = 0; i < skin->count; i++) {
			double ratio = rigid_error(&skin->pairs[i], pose) / (wide * ROBUST_M);
			double trust = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));

			skin->pairs[i].weight = trust / (skin->sigma_m[i] * skin->sigma_m[i]);
		}
		if (rigid_fit(skin->pairs, skin->count, pose))
			return false;
	}
	return true;
}

static bool moved_as_one(const struct skin *skin, const struct pose *moved)
{
	struct pose still = POSE_IDENTITY;

	if (head_distance_m(&still, moved) <= SLIP_M)
		return false;
	double before_m = median_error_m(skin, &still);

	return before_m > SLIP_M && median_error_m(skin, moved) < AS_ONE_SHARE * before_m;
}

static void smooth(struct face_state *face, const struct pose *moved, double dt_s)
{
	double gain = face->slipping_s > 0 ? fmin(dt_s / SMOOTH_S, 1) : 1;
	struct vec3 turn_rad = pose_to_rotation_vector(moved);

	face->shift_m =
		vec3_add(face->shift_m, vec3_scale(vec3_sub(moved->t, face->shift_m), gain));
	face->turn_rad =
		vec3_add(face->turn_rad, vec3_scale(vec3_sub(turn_rad, face->turn_rad), gain));
}

/* All that is known in head coordinates, in those of the skull. */
static void correct(struct tracker_state *state, int actor)
{
	struct face_state *face = &state->faces[actor];
	struct frame_state *f = &state->frames[actor];
	struct pose moved = pose_from_rotation_vector(face->turn_rad);
	int count = 0;
	double sum_m = 0;

	moved.t = face->shift_m;
	struct pose back = pose_inverse(&moved);
	f->rt_stage_frame = pose_compose(&f->rt_stage_frame, &moved);
	for (int i = f->label_first; i < f->label_end; i++) {
		struct label_state *label = &state->labels[i];

		if (label->frame != actor)
			continue;
		label->local_m = pose_apply(&back, label->local_m);
		label->filled_m = pose_apply(&back, label->filled_m);
		label->last.local_m = pose_apply(&back, label->last.local_m);
		if (label->kind != LABEL_SKULL)
			continue;
		struct vec3 base_m = pose_apply(&back, label->base_m);
		sum_m += vec3_distance(base_m, label->base_m);
		label->base_m = base_m;
		count++;
	}
	face->slipped_m += count ? sum_m / count : 0;
}

/* No expression moves all skin as one by millimetres: a long slip need not hold for long. */
static double lasting_s(const struct pose *moved)
{
	struct pose still = POSE_IDENTITY;

	return fmax(SLIP_S * fmin(SURE_SLIP_M / head_distance_m(&still, moved), 1), SURE_SLIP_S);
}

void jig_watch(struct tracker_state *state, const struct labelling *l, int actor, double dt_s)
{
	struct face_state *face = &state->faces[actor];
	struct skin skin;
	struct pose moved;

	collect(state, l, actor, &skin);
	if (skin.count < SKIN_MIN || !fit(&skin, &moved) || !moved_as_one(&skin, &moved)) {
		face->slipping_s = 0;
		return;
	}
	smooth(face, &moved, dt_s);
	face->slipping_s += dt_s;
	if (face->slipping_s < lasting_s(&moved))
		return;
	correct(state, actor);
	face->slipping_s = 0;
}
