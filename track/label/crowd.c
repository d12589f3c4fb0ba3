/*
 * Markers are alike and so are faces: after a gap a head's old place is no guide, and whose face it
 * is, the places of its markers say.
 */
#include "track/label/crowd.h"

#include <string.h>

#include "track/head.h"
#include "track/label/segment.h"

#define HEAD_GAP_S 0.05 /* after a gap as long a head must be found, not followed */
#define SEGMENT_GAP_S 0.15
#define SEARCHES_PER_SHOT 3 /* for lost segments */
#define DOUBT_EVERY_SHOTS 10
#define FOLLOWED_S 0.5
#define FOLLOWED_MIN 8
#define FOLLOWED_SHARE 0.6
#define DOUBT_M 0.006
#define DOUBT_REACH_M 0.15
#define EXPLAINED_M 0.006 /* a point this near to where a marker is expected is explained */
#define FIT_REACH_M 0.008 /* a point farther than this from a marker is not it */
#define FIT_MARGIN 12.0   /* how much better one actor must fit than the others ... */
#define FIT_SHARE 0.05    /* ... and this share of it */

/* How far a marker usually is from where its layout has it, by enum label_kind. */
static const double FIT_SCALE_M[] = {0.0015, 0.0005, 0.003};

/* What the frame's markers, where they are expected, explain. */
static void set_taken(struct crowd *crowd, const struct tracker_state *state,
		      const struct labelling *l, int frame, bool taken)
{
	const struct frame_state *f = &state->frames[frame];
	const struct nearby *n = &l->nearby;

	for (int i = f->label_first; i < f->label_end; i++) {
		if (state->labels[i].frame != frame)
			continue;
		struct vec3 where_m =
			pose_apply(&l->rt_stage_frame[frame], l->motion.labels[i].local_m);
		for (int k = nearby_from(n, where_m.x - EXPLAINED_M);
		     k < n->count && n->p_stage_m[k].x <= where_m.x + EXPLAINED_M; k++)
			if (vec3_distance(n->p_stage_m[k], where_m) < EXPLAINED_M)
				crowd->taken[n->point[k]] = taken;
	}
}

static void take_points(struct crowd *crowd, const struct tracker_state *state,
			const struct labelling *l, int frame)
{
	set_taken(crowd, state, l, frame, true);
}

/* Returns how many of the heads are found. */
static uint32_t follow_heads(struct tracker_state *state, struct labelling *l, int64_t now_ns)
{
	uint32_t found = 0;

	for (uint32_t a = 0; a < state->actor_count; a++) {
		const struct frame_state *f = &state->frames[a];
		double gap_s = (double)(now_ns - f->seen_ns) * 1e-9;

		l->found[a] =
			f->tracked && gap_s <= HEAD_GAP_S &&
			head_refine(state, (int)a, &l->motion, &l->nearby, &l->rt_stage_frame[a]);
		found += l->found[a];
	}
	return found;
}

static void follow_segments(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
			    int64_t now_ns)
{
	for (uint32_t f = state->actor_count; f < state->frame_count; f++) {
		const struct frame_state *frame = &state->frames[f];
		double gap_s = (double)(now_ns - frame->seen_ns) * 1e-9;

		l->found[f] = frame->tracked && gap_s <= SEGMENT_GAP_S &&
			      segment_follow(state, l, (int)f, crowd->taken);
		if (l->found[f])
			take_points(crowd, state, l, (int)f);
	}
}

/* Fewer markers than fix a pose hold it: it may have turned away since. */
static bool is_loose(const struct frame_state *f)
{
	return f->held_count < 3 && f->held_count < f->label_count;
}

/* A pose on more of its markers than hold it now, if there is one. */
static void search_segment(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
			   int frame)
{
	int held = l->found[frame] ? (int)state->frames[frame].held_count : 0;

	if (l->found[frame])
		set_taken(crowd, state, l, frame, false);
	if (segment_search(state, l, frame, crowd->taken, held)) {
		l->found[frame] = true;
		state->frames[frame].tracked = false; /* where it was tells no velocity */
	}
	if (l->found[frame])
		take_points(crowd, state, l, frame);
}

/* Some segments in each shot that are lost or loose, of actors whose heads are found. */
static void search_segments(struct crowd *crowd, struct tracker_state *state, struct labelling *l)
{
	uint32_t count = state->frame_count - state->actor_count;
	int searches = 0;

	for (uint32_t tried = 0; tried < count && searches < SEARCHES_PER_SHOT; tried++) {
		uint32_t f = state->actor_count + state->segment_turn++ % count;

		if ((l->found[f] && !is_loose(&state->frames[f])) ||
		    !l->found[state->frames[f].actor])
			continue;
		searches++;
		search_segment(crowd, state, l, (int)f);
	}
}

/* Log-likelihood of the free points under the actor's layout, up to a constant: of a Cauchy error,
 * so that an expression does not weigh too much. */
static double fit_of(const struct tracker_state *state, const struct nearby *free, int frame,
		     const struct pose *pose)
{
	const struct frame_state *f = &state->frames[frame];
	double sum = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];
		double scale_m = FIT_SCALE_M[label->kind], distance2_m2;

		if (label->frame != frame || nearby_nearest(free, pose_apply(pose, label->base_m),
							    FIT_REACH_M, &distance2_m2) < 0)
			continue;
		sum += log((scale_m * scale_m + FIT_REACH_M * FIT_REACH_M) /
			   (scale_m * scale_m + distance2_m2));
	}
	return sum;
}

struct candidate {
	int frame;
	double fit;
	struct pose pose;
};

/* Which of the lost actors fits best near this pose; false when another fits nearly as well. */
static bool choose_actor(const struct tracker_state *state, const struct labelling *l,
			 const struct nearby *free, const struct pose *pose, struct candidate *best)
{
	double second = 0;

	*best = (struct candidate){-1, 0, *pose};
	for (uint32_t a = 0; a < state->actor_count; a++) {
		struct candidate c = {(int)a, 0, *pose};

		if (l->found[a] || !head_refine(state, (int)a, &l->motion, free, &c.pose))
			continue;
		c.fit = fit_of(state, free, (int)a, &c.pose);
		if (c.fit > best->fit) {
			second = best->fit;
			*best = c;
		} else {
			second = fmax(second, c.fit);
		}
	}
	return best->fit > second + FIT_MARGIN + FIT_SHARE * best->fit;
}

/* Looks with one actor's layout for all the faces that are free. */
static void search_heads(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
			 int frame)
{
	struct pose places[ACQUIRE_PLACE_MAX];
	int count = acquire_heads(&crowd->acquire, state, frame, places);

	for (int k = 0; k < count; k++) {
		struct candidate best;

		if (!choose_actor(state, l, &crowd->acquire.free, &places[k], &best))
			continue;
		l->found[best.frame] = true;
		l->rt_stage_frame[best.frame] = best.pose;
		take_points(crowd, state, l, best.frame);
	}
}

/* One actor's layout in each shot: what it finds may be another's. */
static void search_lost(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
			const struct point *points, uint32_t point_count)
{
	for (uint32_t tried = 0; tried < state->actor_count; tried++) {
		uint32_t a = state->acquire_turn % state->actor_count;

		state->acquire_turn = a + 1;
		if (l->found[a])
			continue;
		acquire_begin(&crowd->acquire, points, point_count, crowd->taken);
		search_heads(crowd, state, l, (int)a);
		return;
	}
}

void crowd_find(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
		const struct point *points, uint32_t point_count, int64_t now_ns)
{
	if (follow_heads(state, l, now_ns) == state->frame_count)
		return; /* nobody is left to ask what is taken */
	memset(crowd->taken, 0, sizeof(crowd->taken));
	for (uint32_t a = 0; a < state->actor_count; a++)
		if (l->found[a])
			take_points(crowd, state, l, (int)a);
	follow_segments(crowd, state, l, now_ns);
	search_lost(crowd, state, l, points, point_count);
	search_segments(crowd, state, l);
}

/* Is there a better pose for the head at this place? Its own points are free for the moment, those
 * of the others are not. */
static bool sits_better_elsewhere(struct crowd *crowd, struct tracker_state *state,
				  const struct labelling *l, int frame, const struct pose *measured)
{
	struct pose places[ACQUIRE_PLACE_MAX];
	int count = acquire_heads(&crowd->acquire, state, frame, places);

	for (int k = 0; k < count; k++)
		if (vec3_distance(places[k].t, measured->t) < DOUBT_REACH_M &&
		    head_refine(state, frame, &l->motion, &crowd->acquire.free, &places[k]))
			return head_distance_m(&places[k], measured) > DOUBT_M;
	return false;
}

/* Rigid markers have held the head before, and most of what is seen has kept its name since long:
 * it was followed, and not settled on. */
static bool is_followed(const struct tracker_state *state, const struct labelling *l, int frame)
{
	const struct frame_state *f = &state->frames[frame];
	int seen = 0, old = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		if (!l->seen[i] || state->labels[i].frame != frame)
			continue;
		seen++;
		old += state->labels[i].named_s > FOLLOWED_S;
	}
	return f->was_held && old >= FOLLOWED_MIN && old > FOLLOWED_SHARE * seen;
}

bool crowd_doubt(struct crowd *crowd, struct tracker_state *state, struct labelling *l,
		 const struct point *points, uint32_t point_count, int frame,
		 const struct head *measured)
{
	struct frame_state *f = &state->frames[frame];

	if (measured->rigid_count >= 3) {
		f->unheld_count = 0;
		f->was_held = true;
		return true;
	}
	if (++f->unheld_count % DOUBT_EVERY_SHOTS != 0 || is_followed(state, l, frame))
		return true;
	memset(crowd->taken, 0, sizeof(crowd->taken));
	for (uint32_t a = 0; a < state->actor_count; a++)
		if (l->found[a] && (int)a != frame)
			take_points(crowd, state, l, (int)a);
	acquire_begin(&crowd->acquire, points, point_count, crowd->taken);
	return !sits_better_elsewhere(crowd, state, l, frame, &measured->rt_stage_head);
}
