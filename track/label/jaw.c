/*
 * The jaw turns about the condyles; as it opens wider they slide forward, which keeps the chin near
 * the tangent. Bonwill's triangle and Balkwill's angle say where they are: 100 mm from the lower
 * incisors, the line between rising by 26 degrees.
 */
#include "track/label/jaw.h"

#include <string.h>

#define BACK_M 0.090 /* from the mouth to the condyles */
#define UP_M 0.044
#define EDGE_RAD 0.04  /* of elevation about them, from skin that stays to skin that goes */
#define SHARE_MIN 0.05 /* less is not the jaw's */
#define STEP_RAD 0.025 /* 2.5 mm at the chin */
#define STEPS 36
#define SCALE_M 0.005 /* jaws differ */
#define REACH_M 0.009
#define MISSING_MIN 3

static double elevation_rad(struct vec3 v)
{
	return atan2(v.y, hypot(v.x, v.z));
}

/* Of the groups that have an opposite the lowest: a lip. */
static const char *find_lip(const struct layout *layout, const struct layout_actor *actor)
{
	const struct layout_marker *lowest = NULL;

	for (uint32_t i = actor->first; i < actor->first + actor->count; i++) {
		const struct layout_marker *marker = &layout->markers[i];
		bool opposed = false;

		for (uint32_t k = actor->first; k < actor->first + actor->count; k++)
			opposed |= predict_opposes(marker->group, layout->markers[k].group);
		if (opposed && (!lowest || marker->neutral_m.y < lowest->neutral_m.y))
			lowest = marker;
	}
	return lowest ? lowest->group : NULL;
}

static bool find_mouth(const struct layout *layout, const struct layout_actor *actor,
		       struct vec3 *mouth_m)
{
	const char *lip = find_lip(layout, actor);
	struct vec3 sum[2] = {{0, 0, 0}, {0, 0, 0}};
	int count[2] = {0, 0};

	if (!lip)
		return false;
	for (uint32_t i = actor->first; i < actor->first + actor->count; i++) {
		const struct layout_marker *marker = &layout->markers[i];
		bool is_other = predict_opposes(lip, marker->group);

		if (!is_other && strcmp(lip, marker->group) != 0)
			continue;
		sum[is_other] = vec3_add(sum[is_other], marker->neutral_m);
		count[is_other]++;
	}
	*mouth_m = vec3_add(vec3_scale(sum[0], 0.5 / count[0]), vec3_scale(sum[1], 0.5 / count[1]));
	return true;
}

void jaw_init(struct tracker_state *state, const struct layout *layout, int actor)
{
	const struct layout_actor *range = &layout->actors[actor];
	struct vec3 mouth_m;

	if (!find_mouth(layout, range, &mouth_m))
		return;
	struct vec3 hinge_m = {mouth_m.x, mouth_m.y + UP_M, mouth_m.z - BACK_M};
	double mouth_rad = elevation_rad(vec3_sub(mouth_m, hinge_m));
	for (uint32_t i = range->first; i < range->first + range->count; i++) {
		struct label_state *label = &state->labels[i];
		struct vec3 arm_m = vec3_sub(label->base_m, hinge_m);
		double above_rad = elevation_rad(arm_m) - mouth_rad;
		double share = 1 / (1 + exp(above_rad / EDGE_RAD));

		if (label->kind == LABEL_SKIN && share > SHARE_MIN && arm_m.z > 0)
			label->jaw_m_rad = vec3_scale((struct vec3){0, -arm_m.z, arm_m.y}, share);
	}
}

static bool is_of_jaw(const struct tracker_state *state, int i, int actor)
{
	return state->labels[i].frame == actor && state->labels[i].jaw_m_rad.y != 0;
}

/* How well the lower face lies on points with the jaw so far open: each point counts once, for the
 * marker that is nearest to it. */
static double fit_of(const struct tracker_state *state, const struct labelling *l, int actor,
		     double open_rad)
{
	const struct frame_state *f = &state->frames[actor];
	double best[POINT_MAX] = {0}, sum = 0, distance2_m2;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		if (!is_of_jaw(state, i, actor))
			continue;
		struct vec3 local_m =
			vec3_add(label->base_m, vec3_scale(label->jaw_m_rad, open_rad));
		int k = nearby_nearest(&l->nearby, pose_apply(&l->rt_stage_frame[actor], local_m),
				       REACH_M, &distance2_m2);
		if (k < 0)
			continue;
		double fit = 1 / (1 + distance2_m2 / (SCALE_M * SCALE_M));
		sum += fmax(fit - best[k], 0);
		best[k] = fmax(fit, best[k]);
	}
	return sum;
}

static double find_opening_rad(const struct tracker_state *state, const struct labelling *l,
			       int actor)
{
	double best_rad = 0, best = -1;

	for (int k = 0; k < STEPS; k++) {
		double fit = fit_of(state, l, actor, k * STEP_RAD);

		if (fit > best) {
			best = fit;
			best_rad = k * STEP_RAD;
		}
	}
	return best_rad;
}

static int count_missing(const struct tracker_state *state, const struct labelling *l, int actor)
{
	const struct frame_state *f = &state->frames[actor];
	int missing = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		missing += is_of_jaw(state, i, actor) && !l->motion.labels[i].recent;
	return missing;
}

void jaw_lean(struct tracker_state *state, struct labelling *l)
{
	for (uint32_t a = 0; a < state->actor_count; a++) {
		const struct frame_state *f = &state->frames[a];
		bool unknown = l->found[a] && count_missing(state, l, (int)a) >= MISSING_MIN;
		double open_rad = unknown ? find_opening_rad(state, l, (int)a) : 0;

		for (int i = f->label_first; i < f->label_end; i++) {
			struct label_state *label = &state->labels[i];

			if (!is_of_jaw(state, i, (int)a))
				continue;
			label->lean_m = vec3_scale(label->jaw_m_rad, open_rad);
			if (unknown && !l->motion.labels[i].recent)
				l->motion.labels[i].local_m =
					vec3_add(label->base_m, label->lean_m);
		}
	}
}
