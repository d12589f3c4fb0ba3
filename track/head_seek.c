/*
 * A look at a few markers all over the head, then at every third.
 */
#include "track/head_seek.h"

#include <stddef.h>

#include "track/head.h"

#define OFF_M 0.0005 /* a head that is nearer to where it was expected stays there */
#define LOOKS 6      /* markers looked for first */
#define LOOKS_MIN 3  /* of them found */
#define STRIDE 3     /* one of so many is looked for when they were off */

/* It was seen in the last shot and should be near. */
static bool is_followed(const struct tracker_state *state, const struct matcher *m, int frame,
			int label)
{
	const struct label_state *l = &state->labels[label];

	return l->frame == frame && m->seed_of_label[label] >= 0 &&
	       l->seen_ns == state->mid_exposure_ns;
}

static int count_followed(const struct tracker_state *state, const struct matcher *m, int frame)
{
	const struct frame_state *f = &state->frames[frame];
	int count = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		count += is_followed(state, m, frame, i);
	return count;
}

/* The points near every stride-th of the markers that are followed, in the matcher's candidates,
 * each with the marker's label. */
static uint32_t look_for(const struct tracker_state *state, struct matcher *m, int frame,
			 int stride)
{
	const struct frame_state *f = &state->frames[frame];
	uint32_t count = 0;
	int passed = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		struct point *point = &m->candidates[count];

		if (!is_followed(state, m, frame, i) || passed++ % stride != 0 ||
		    !match_try_seed(m, m->seed_of_label[i], point))
			continue;
		point->label = (int16_t)i;
		count++;
	}
	return count;
}

/* Most of a few markers are where they were expected. */
static bool is_on(const struct tracker_state *state, struct matcher *m, int frame, int followed)
{
	int stride = followed > LOOKS ? followed / LOOKS : 1;
	uint32_t count = look_for(state, m, frame, stride), off = 0;

	for (uint32_t k = 0; k < count; k++) {
		int seed = m->seed_of_label[m->candidates[k].label];

		off += vec3_distance(m->candidates[k].fix.p_stage_m, m->seed_stage_m[seed]) > OFF_M;
	}
	return count >= LOOKS_MIN && 2 * off <= count;
}

static bool seek_head(const struct tracker_state *state, struct labelling *l, struct matcher *m,
		      int actor)
{
	int followed = count_followed(state, m, actor);
	struct pose pose = l->rt_stage_frame[actor];

	if (followed < LOOKS || is_on(state, m, actor, followed))
		return false;
	nearby_build(&l->nearby, m->candidates, look_for(state, m, actor, STRIDE), NULL);
	if (!head_refine(state, actor, &l->motion, &l->nearby, &pose))
		return false;
	l->rt_stage_frame[actor] = pose;
	return true;
}

bool seek_heads(const struct tracker_state *state, struct labelling *labelling,
		struct matcher *matcher)
{
	bool any = false;

	for (uint32_t a = 0; a < state->actor_count; a++)
		any |= state->frames[a].tracked && seek_head(state, labelling, matcher, (int)a);
	return any;
}
