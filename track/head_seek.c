/*
 * A look at a few markers all over the head, then at many.
 */
#include "track/head_seek.h"

#include <stddef.h>

#include "track/head.h"

#define OFF_M 0.0005     /* a head that is nearer to where it was expected stays there */
#define LOOKS 6          /* markers looked for first, or somewhat more */
#define LOOKS_MIN 3      /* of them found */
#define STRIDE 3         /* one of so many is looked for when they were off ... */
#define STRIDE_FROM 36   /* ... where there are so many, else all */
#define SOUGHT_MIN 8     /* of them found: of fewer, faces that move would turn the head */
#define NEARER_SHARE 0.6 /* of them are nearer to their markers than before */

/* It was seen in the last shot, and it is known how it moves. */
static bool is_followed(const struct tracker_state *state, const struct labelling *l,
			const struct matcher *m, int frame, int label)
{
	return state->labels[label].frame == frame && m->seed_of_label[label] >= 0 &&
	       state->labels[label].seen_ns == state->mid_exposure_ns &&
	       l->motion.labels[label].recent;
}

static int count_followed(const struct tracker_state *state, const struct labelling *l,
			  const struct matcher *m, int frame)
{
	const struct frame_state *f = &state->frames[frame];
	int count = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		count += is_followed(state, l, m, frame, i);
	return count;
}

/* The points near every stride-th of the markers that are followed, in the matcher's candidates,
 * each with the marker's label. */
static uint32_t look_for(const struct tracker_state *state, const struct labelling *l,
			 struct matcher *m, int frame, int stride)
{
	const struct frame_state *f = &state->frames[frame];
	uint32_t count = 0;
	int passed = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		struct point *point = &m->candidates[count];

		if (!is_followed(state, l, m, frame, i) || passed++ % stride != 0 ||
		    !match_try_seed(m, m->seed_of_label[i], point))
			continue;
		point->label = (int16_t)i;
		count++;
	}
	return count;
}

/* Of a point looked for, from where its marker would be. */
static double off_m(const struct labelling *l, const struct point *point, const struct pose *pose)
{
	struct vec3 expected_m = pose_apply(pose, l->motion.labels[point->label].local_m);

	return vec3_distance(point->fix.p_stage_m, expected_m);
}

/* Most of a few markers are where they were expected. */
static bool is_on(const struct tracker_state *state, const struct labelling *l, struct matcher *m,
		  int frame, int followed)
{
	uint32_t count = look_for(state, l, m, frame, followed / LOOKS), off = 0;

	for (uint32_t k = 0; k < count; k++)
		off += off_m(l, &m->candidates[k], &l->rt_stage_frame[frame]) > OFF_M;
	return count >= LOOKS_MIN && 2 * off <= count;
}

/* Most points are nearer to their markers: else it was the face that moved, not the head. */
static bool is_better(const struct labelling *l, const struct matcher *m, uint32_t count,
		      const struct pose *pose, const struct pose *before)
{
	uint32_t nearer = 0;

	for (uint32_t k = 0; k < count; k++)
		nearer += off_m(l, &m->candidates[k], pose) < off_m(l, &m->candidates[k], before);
	return (double)nearer >= NEARER_SHARE * count;
}

static bool seek_head(const struct tracker_state *state, struct labelling *l, struct matcher *m,
		      int actor)
{
	int followed = count_followed(state, l, m, actor);
	struct pose pose = l->rt_stage_frame[actor];

	if (followed < SOUGHT_MIN || is_on(state, l, m, actor, followed))
		return false;
	int stride = followed < STRIDE_FROM ? 1 : STRIDE;
	uint32_t count = look_for(state, l, m, actor, stride);
	nearby_build(&l->nearby, m->candidates, count, NULL);
	if (count < SOUGHT_MIN || !head_refine(state, actor, &l->motion, &l->nearby, &pose) ||
	    !is_better(l, m, count, &pose, &l->rt_stage_frame[actor]))
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
