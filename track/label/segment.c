/*
 * Fits lean on the predicted pose where fewer than three markers are seen. The search tries all
 * triangles; of the poses that lay the most markers on points, it takes the one nearest to how the
 * body hangs on the head.
 */
#include "track/label/segment.h"

#include "track/head.h"
#include "track/rigid.h"

#define MARKER_SIGMA_M 0.002
#define LEAN_SIGMA_M 0.02 /* how far the predicted pose may be off */
#define LEAN_ARM_M 0.05   /* where it is held: so far from the segment's middle */
#define LEAN_COUNT 4
#define FOLLOW_NEAR_M 0.012 /* from where a marker is expected that was just seen */
#define RETURN_NEAR_M 0.02  /* ... and where one was hidden */
#define ROBUST_M 0.008
#define MISFIT_M 0.003 /* a marker this far off is another one */
#define ROUNDS 3
#define PAIR_MAX 64

#define POINT_NEAR_MAX 96 /* about a head */
#define REACH_M 0.35      /* how far a segment may be from where it hangs in the neutral pose */
#define TURN_MAX_RAD 1.9  /* ... and how far turned */
#define SLACK_M 0.004     /* of a distance between its markers */
#define FOUND_M 0.005     /* a marker this near to a point is found */
#define SIDE_MIN_M 0.03
#define TRIANGLES_MAX 20
#define SAME_POSE_M 0.03
#define COST_MARGIN 6.0
#define SIDE_COST_MAX 1.5

struct segment_pairs {
	int count;
	struct rigid_pair pairs[PAIR_MAX + LEAN_COUNT];
};

static struct vec3 middle_of(const struct tracker_state *state, int frame)
{
	const struct frame_state *f = &state->frames[frame];
	struct vec3 sum = {0, 0, 0};

	for (int i = f->label_first; i < f->label_end; i++)
		if (state->labels[i].frame == frame)
			sum = vec3_add(sum, state->labels[i].base_m);
	return vec3_scale(sum, 1.0 / f->label_count);
}

/* Weak pairs that hold the pose where the markers leave it free. */
static void lean_on(struct segment_pairs *pairs, struct vec3 middle_m, const struct pose *pose)
{
	for (int k = 0; k < LEAN_COUNT; k++) {
		struct vec3 from = middle_m;

		from.x += k == 1 ? LEAN_ARM_M : 0;
		from.y += k == 2 ? LEAN_ARM_M : 0;
		from.z += k == 3 ? LEAN_ARM_M : 0;
		pairs->pairs[pairs->count + k] = (struct rigid_pair){
			from, pose_apply(pose, from), 1 / (LEAN_SIGMA_M * LEAN_SIGMA_M)};
	}
}

/* Rounds of weighting by the error. Returns how many markers agree. */
static int fit_pairs(struct segment_pairs *pairs, struct vec3 middle_m, struct pose *pose)
{
	int agree = 0;

	lean_on(pairs, middle_m, pose);
	for (int round = 0; round < ROUNDS; round++) {
		double scale_m = ROBUST_M * (round == 0 ? 6 : round == 1 ? 2 : 1);

		agree = 0;
		for (int i = 0; i < pairs->count; i++) {
			double ratio = rigid_error(&pairs->pairs[i], pose) / scale_m;

			pairs->pairs[i].weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio) *
						      MARKER_SIGMA_M * MARKER_SIGMA_M);
		}
		if (rigid_fit(pairs->pairs, pairs->count + LEAN_COUNT, pose))
			return 0;
		for (int i = 0; i < pairs->count; i++)
			agree += rigid_error(&pairs->pairs[i], pose) < ROBUST_M;
	}
	return agree;
}

static void add_pair(struct segment_pairs *pairs, struct vec3 from_m, struct vec3 to_m)
{
	if (pairs->count < PAIR_MAX)
		pairs->pairs[pairs->count++] = (struct rigid_pair){from_m, to_m, 1};
}

/* The nearest point that nobody has taken. */
static int nearest_free(const struct nearby *n, const bool *taken, struct vec3 where_m,
			double radius_m)
{
	double best_m = radius_m;
	int best = -1;

	for (int k = nearby_from(n, where_m.x - radius_m);
	     k < n->count && n->p_stage_m[k].x <= where_m.x + radius_m; k++) {
		double distance_m = vec3_distance(n->p_stage_m[k], where_m);

		if (!taken[n->point[k]] && distance_m < best_m) {
			best_m = distance_m;
			best = k;
		}
	}
	return best;
}

/* A fit that some of its markers misfit. */
static bool misfits(const struct segment_pairs *pairs, const struct pose *pose)
{
	for (int i = 0; i < pairs->count; i++)
		if (rigid_error(&pairs->pairs[i], pose) >= MISFIT_M)
			return true;
	return false;
}

/* The first `recent` pairs were there a moment ago and know best: the others, who come back, may
 * not drive them out unless they are more. What does not stay is taken off the end. */
static int fit_with_back(struct segment_pairs *pairs, int recent, struct vec3 middle_m,
			 struct pose *pose)
{
	struct segment_pairs held = *pairs;
	struct pose without = *pose;
	int agree = fit_pairs(pairs, middle_m, pose), held_agree;

	held.count = recent;
	if (pairs->count == recent || pairs->count > 2 * recent || !misfits(pairs, pose))
		return agree;
	held_agree = fit_pairs(&held, middle_m, &without);
	if (held_agree == 0 || misfits(&held, &without))
		return agree;
	*pairs = held;
	*pose = without;
	return held_agree;
}

/* Pairs those markers with points that were seen a moment ago, or those that were not. */
static void pair_nearest(const struct tracker_state *state, const struct labelling *l, int frame,
			 const bool *taken, bool recent, struct segment_pairs *pairs)
{
	const struct frame_state *f = &state->frames[frame];
	double radius_m = recent ? FOLLOW_NEAR_M : RETURN_NEAR_M;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct prediction *p = &l->motion.labels[i];

		if (state->labels[i].frame != frame || p->recent != recent)
			continue;
		struct vec3 where_m = pose_apply(&l->rt_stage_frame[frame], p->local_m);
		int k = nearest_free(&l->nearby, taken, where_m, radius_m);
		if (k >= 0)
			add_pair(pairs, p->local_m, l->nearby.p_stage_m[k]);
	}
}

bool segment_follow(const struct tracker_state *state, struct labelling *l, int frame,
		    const bool *taken)
{
	struct pose pose = l->rt_stage_frame[frame];
	struct segment_pairs pairs = {.count = 0};

	pair_nearest(state, l, frame, taken, true, &pairs);
	int recent = pairs.count;
	pair_nearest(state, l, frame, taken, false, &pairs);
	if (fit_with_back(&pairs, recent, middle_of(state, frame), &pose) == 0)
		return false;
	l->rt_stage_frame[frame] = pose;
	return true;
}

/* The named markers, those seen a moment ago or those that were not. */
static void pair_named(const struct tracker_state *state, const struct labelling *l, int frame,
		       const struct point *points, bool recent, struct segment_pairs *pairs,
		       int16_t label[PAIR_MAX])
{
	const struct frame_state *f = &state->frames[frame];

	for (int i = f->label_first; i < f->label_end && pairs->count < PAIR_MAX; i++) {
		if (state->labels[i].frame != frame || l->point_of_label[i] < 0 ||
		    l->motion.labels[i].recent != recent)
			continue;
		label[pairs->count] = (int16_t)i;
		add_pair(pairs, state->labels[i].base_m,
			 points[l->point_of_label[i]].fix.p_stage_m);
	}
}

void segment_fit(const struct tracker_state *state, struct labelling *l, int frame,
		 const struct point *points, struct head *out)
{
	struct pose pose = l->rt_stage_frame[frame];
	struct segment_pairs pairs = {.count = 0};
	int16_t label[PAIR_MAX];

	out->valid = 0;
	pair_named(state, l, frame, points, true, &pairs, label);
	int recent = pairs.count;
	pair_named(state, l, frame, points, false, &pairs, label);
	int count = pairs.count;
	if (fit_with_back(&pairs, recent, middle_of(state, frame), &pose) == 0)
		return;
	for (int k = 0; k < count; k++) {
		if (k < pairs.count && rigid_error(&pairs.pairs[k], &pose) < MISFIT_M)
			continue;
		l->seen[label[k]] = false;
		l->point_of_label[label[k]] = ASSIGN_NONE;
	}
	out->valid = 1;
	out->rigid_count = (uint8_t)pairs.count;
	out->rt_stage_head = pose;
}

struct segment_search {
	const struct tracker_state *state;
	int frame;
	struct pose rt_stage_neutral; /* as it hangs on what carries it, in the neutral pose */
	struct vec3 middle_m;
	int point_count;
	struct vec3 points_m[POINT_NEAR_MAX];
	int label_count;
	struct vec3 places_m[PAIR_MAX];
	int best_found, rival_found;
	double best_cost, rival_cost;
	struct pose best;
};

static void begin_search(struct segment_search *s, const struct labelling *l, const bool *taken)
{
	const struct frame_state *f = &s->state->frames[s->frame];
	double reach_m = REACH_M;

	for (int i = f->label_first; i < f->label_end; i++)
		if (s->state->labels[i].frame == s->frame && s->label_count < PAIR_MAX)
			s->places_m[s->label_count++] = s->state->labels[i].base_m;
	for (int i = 0; i < s->label_count; i++)
		reach_m = fmax(reach_m, REACH_M + vec3_distance(s->places_m[i], s->middle_m));
	struct vec3 hangs_m = pose_apply(&s->rt_stage_neutral, s->middle_m);
	for (int k = nearby_from(&l->nearby, hangs_m.x - reach_m);
	     k < l->nearby.count && s->point_count < POINT_NEAR_MAX; k++)
		if (!taken[l->nearby.point[k]] &&
		    vec3_distance(l->nearby.p_stage_m[k], hangs_m) < reach_m)
			s->points_m[s->point_count++] = l->nearby.p_stage_m[k];
}

static double nearest2_m2(const struct segment_search *s, struct vec3 where_m)
{
	double best2 = INFINITY;

	for (int k = 0; k < s->point_count; k++) {
		struct vec3 d = vec3_sub(s->points_m[k], where_m);

		best2 = fmin(best2, vec3_dot(d, d));
	}
	return best2;
}

static void weigh_pose(struct segment_search *s, const struct pose *pose)
{
	struct pose back = pose_inverse(&s->rt_stage_neutral), turn = pose_compose(pose, &back);
	double angle_rad = vec3_norm(pose_to_rotation_vector(&turn));
	struct vec3 middle_m = pose_apply(pose, s->middle_m);
	double off_m = vec3_distance(middle_m, pose_apply(&s->rt_stage_neutral, s->middle_m));
	double cost = angle_rad * angle_rad / 0.25 + off_m * off_m / 0.0225;
	int found = 0;

	if (angle_rad > TURN_MAX_RAD || off_m > REACH_M)
		return;
	for (int i = 0; i < s->label_count; i++) {
		double d2 = nearest2_m2(s, pose_apply(pose, s->places_m[i]));

		found += d2 < FOUND_M * FOUND_M;
		cost += fmin(d2, FOUND_M * FOUND_M) / (MARKER_SIGMA_M * MARKER_SIGMA_M);
	}
	bool better = found > s->best_found || (found == s->best_found && cost < s->best_cost);
	bool same = s->best_found > 0 && head_distance_m(pose, &s->best) < SAME_POSE_M;
	if (better) {
		if (!same) {
			s->rival_found = s->best_found;
			s->rival_cost = s->best_cost;
		}
		s->best_found = found;
		s->best_cost = cost;
		s->best = *pose;
	} else if (!same &&
		   (found > s->rival_found || (found == s->rival_found && cost < s->rival_cost))) {
		s->rival_found = found;
		s->rival_cost = cost;
	}
}

static bool side_fits(const struct segment_search *s, int a, int b, int p, int q)
{
	double side_m = vec3_distance(s->places_m[a], s->places_m[b]);

	return p != q && side_m > SIDE_MIN_M &&
	       fabs(vec3_distance(s->points_m[p], s->points_m[q]) - side_m) < SLACK_M;
}

static void try_triangle(struct segment_search *s, int a, int b, int c)
{
	for (int p = 0; p < s->point_count; p++)
		for (int q = 0; q < s->point_count; q++) {
			if (!side_fits(s, a, b, p, q))
				continue;
			for (int r = 0; r < s->point_count; r++) {
				struct rigid_pair pairs[3] = {{s->places_m[a], s->points_m[p], 1},
							      {s->places_m[b], s->points_m[q], 1},
							      {s->places_m[c], s->points_m[r], 1}};
				struct pose pose;

				if (side_fits(s, a, c, p, r) && side_fits(s, b, c, q, r) &&
				    !rigid_fit(pairs, 3, &pose))
					weigh_pose(s, &pose);
			}
		}
}

/* Two markers and the way the segment hangs, where no third one shows. */
static void try_side(struct segment_search *s, int a, int b)
{
	for (int p = 0; p < s->point_count; p++)
		for (int q = 0; q < s->point_count; q++) {
			struct segment_pairs pairs = {.count = 0};
			struct pose pose = s->rt_stage_neutral;

			if (!side_fits(s, a, b, p, q))
				continue;
			add_pair(&pairs, s->places_m[a], s->points_m[p]);
			add_pair(&pairs, s->places_m[b], s->points_m[q]);
			lean_on(&pairs, s->middle_m, &pose);
			for (int i = 0; i < pairs.count; i++)
				pairs.pairs[i].weight = 1 / (MARKER_SIGMA_M * MARKER_SIGMA_M);
			if (!rigid_fit(pairs.pairs, pairs.count + LEAN_COUNT, &pose))
				weigh_pose(s, &pose);
		}
}

/* Of the actor's found frames nearer to the head the nearest one: the torso carries the upper arm,
 * that the forearm, and the head the torso. */
static int carrier_of(const struct tracker_state *state, const struct labelling *l, int frame)
{
	int actor = state->frames[frame].actor, best = actor;
	struct vec3 middle_m = middle_of(state, frame);
	struct vec3 head_m = middle_of(state, actor);
	double own_m = vec3_distance(head_m, middle_m), best_m = own_m;

	for (int f = (int)state->actor_count; f < (int)state->frame_count; f++) {
		if (f == frame || state->frames[f].actor != actor || !l->found[f])
			continue;
		double distance_m = vec3_distance(middle_of(state, f), middle_m);
		if (distance_m < best_m && vec3_distance(middle_of(state, f), head_m) < own_m) {
			best_m = distance_m;
			best = f;
		}
	}
	return best;
}

/* Two markers must also hang nearly as in the neutral pose. */
static bool is_convincing(const struct segment_search *s)
{
	double missing = (double)(s->label_count - s->best_found) * (FOUND_M * FOUND_M) /
			 (MARKER_SIGMA_M * MARKER_SIGMA_M);

	if (s->rival_found == s->best_found && s->rival_cost < s->best_cost + COST_MARGIN)
		return false;
	return s->best_found >= 3 || (s->best_found == 2 && s->best_cost - missing < SIDE_COST_MAX);
}

/* Some triangles of its markers, those behind the ones of the last search: any of the markers may
 * be hidden for long. */
static void try_triangles(struct segment_search *s, uint32_t begin)
{
	uint32_t n = (uint32_t)s->label_count, index = 0;
	uint32_t all = n < 3 ? 0 : n * (n - 1) * (n - 2) / 6;

	for (int a = 0; a < s->label_count; a++)
		for (int b = a + 1; b < s->label_count; b++)
			for (int c = b + 1; c < s->label_count; c++, index++)
				if ((index + all - begin % all) % all < TRIANGLES_MAX)
					try_triangle(s, a, b, c);
}

static void try_sides(struct segment_search *s, uint32_t begin)
{
	uint32_t n = (uint32_t)s->label_count, index = 0;
	uint32_t all = n * (n - 1) / 2;

	for (int a = 0; a < s->label_count; a++)
		for (int b = a + 1; b < s->label_count; b++, index++)
			if ((index + all - begin % all) % all < TRIANGLES_MAX)
				try_side(s, a, b);
}

bool segment_search(struct tracker_state *state, struct labelling *l, int frame, const bool *taken,
		    int held)
{
	struct segment_search s = {.state = state,
				   .frame = frame,
				   .middle_m = middle_of(state, frame),
				   .rt_stage_neutral =
					   l->rt_stage_frame[carrier_of(state, l, frame)]};
	uint32_t *cursor = &state->frames[frame].acquire_cursor;

	begin_search(&s, l, taken);
	try_triangles(&s, *cursor);
	if (s.best_found < 3)
		try_sides(&s, *cursor);
	*cursor += TRIANGLES_MAX;
	if (s.best_found <= held || !is_convincing(&s))
		return false;
	l->rt_stage_frame[frame] = s.best;
	return true;
}
