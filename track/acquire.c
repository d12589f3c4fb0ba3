/*
 * Triangle search for a head. Pairs of points are sorted by distance once, so that a side of the
 * layout's triangle finds its candidates at once.
 */
#include "track/acquire.h"

#include <math.h>
#include <string.h>

#include "track/head.h"
#include "track/rigid.h"

#define RIGID_SLACK_M 0.002 /* of a distance between rigid markers: how well a jig is measured */
#define SKIN_SLACK_M 0.004  /* ... and between skin markers: expressions */
#define RIGID_NEAR_M 0.0025 /* a rigid marker this near to a point is found */
#define SKIN_NEAR_M 0.007
#define BASE_MIN_M 0.04 /* sides of a useful triangle */
#define AREA_MIN_M2 2e-4
#define TRIANGLES_PER_SHOT 40
#define POSES_PER_SHOT 4000
#define FOUND_MIN 6      /* markers on points, at least ... */
#define FOUND_SHARE 0.6  /* ... and of all markers or points there, whichever is fewer */
#define RIVAL_SHARE 0.85 /* another pose that finds this share as many makes it ambiguous */
#define SAME_POSE_M 0.01
#define FEW 15 /* so many markers are tried first */

struct triangle {
	int marker[3];
	double slack_m;
};

/* The markers of a head. */
struct shape {
	int count, rigid_count;
	struct vec3 place_m[LABEL_MAX]; /* the rigid ones first */
};

struct search {
	const struct acquire_scratch *scratch;
	struct shape shape;
	int poses_left;
	bool has_best;
	int best_found, rival_found;
	struct pose best;
};

static void add_kind(struct shape *shape, const struct tracker_state *state, int frame, bool rigid)
{
	const struct frame_state *f = &state->frames[frame];

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		if (label->frame == frame && (label->kind == LABEL_SKULL) == rigid)
			shape->place_m[shape->count++] = label->base_m;
	}
}

static int bin_of(double distance_m)
{
	return (int)(distance_m / ACQUIRE_BIN_M);
}

/* Calls for every pair of a useful length: first to count the bins, then to fill them. */
static void sort_pairs(struct acquire_scratch *s, int *fill)
{
	const struct nearby *n = &s->free;

	for (int a = 0; a < n->count; a++)
		for (int b = a + 1;
		     b < n->count && n->p_stage_m[b].x < n->p_stage_m[a].x + ACQUIRE_SIDE_MAX_M;
		     b++) {
			double d = vec3_distance(n->p_stage_m[a], n->p_stage_m[b]);

			if (d < BASE_MIN_M - SKIN_SLACK_M || d >= ACQUIRE_SIDE_MAX_M)
				continue;
			if (!fill) {
				s->bin_start[bin_of(d) + 1]++;
				continue;
			}
			int slot = fill[bin_of(d)]++;
			if (slot < ACQUIRE_PAIR_MAX)
				s->pairs[slot] = (struct acquire_pair){(uint16_t)a, (uint16_t)b};
		}
}

void acquire_begin(struct acquire_scratch *s, const struct point *points, uint32_t point_count,
		   const bool *taken)
{
	int fill[ACQUIRE_BIN_COUNT];

	nearby_build(&s->free, points, point_count, taken);
	memset(s->bin_start, 0, sizeof(s->bin_start));
	sort_pairs(s, NULL);
	for (int b = 0; b < ACQUIRE_BIN_COUNT; b++) {
		s->bin_start[b + 1] += s->bin_start[b];
		fill[b] = s->bin_start[b];
	}
	sort_pairs(s, fill);
	for (int b = 0; b <= ACQUIRE_BIN_COUNT; b++)
		if (s->bin_start[b] > ACQUIRE_PAIR_MAX)
			s->bin_start[b] = ACQUIRE_PAIR_MAX;
}

/* How many markers of the layout lie on a point. Gives up early on what is plainly wrong. */
static int count_found(const struct search *search, const struct pose *pose)
{
	const struct shape *shape = &search->shape;
	int found = 0;

	for (int i = 0; i < shape->count; i++) {
		double near_m = i < shape->rigid_count ? RIGID_NEAR_M : SKIN_NEAR_M, distance2_m2;

		found += nearby_nearest(&search->scratch->free, pose_apply(pose, shape->place_m[i]),
					near_m, &distance2_m2) >= 0;
		if (i == FEW && found < 3)
			return 0;
	}
	return found;
}

static void weigh_pose(struct search *search, const struct pose *pose)
{
	int found = count_found(search, pose);
	bool same = search->has_best && head_distance_m(pose, &search->best) < SAME_POSE_M;

	if (found > search->best_found) {
		if (search->has_best && !same)
			search->rival_found = search->best_found;
		search->best_found = found;
		search->best = *pose;
		search->has_best = true;
	} else if (!same && found > search->rival_found) {
		search->rival_found = found;
	}
}

static void try_points(struct search *search, const struct triangle *triangle, int p0, int p1,
		       int p2)
{
	const struct vec3 *points = search->scratch->free.p_stage_m;
	int chosen[3] = {p0, p1, p2};
	struct rigid_pair pairs[3];
	struct pose pose;

	for (int i = 0; i < 3; i++)
		pairs[i] = (struct rigid_pair){search->shape.place_m[triangle->marker[i]],
					       points[chosen[i]], 1};
	search->poses_left--;
	if (!rigid_fit(pairs, 3, &pose))
		weigh_pose(search, &pose);
}

static double side_m(const struct shape *shape, int a, int b)
{
	return vec3_distance(shape->place_m[a], shape->place_m[b]);
}

/* The side 0-1 is on points (p0, p1): which third points fit the other two sides? */
static void try_base(struct search *search, const struct triangle *triangle, int p0, int p1)
{
	const struct nearby *n = &search->scratch->free;
	double side_02 = side_m(&search->shape, triangle->marker[0], triangle->marker[2]);
	double side_12 = side_m(&search->shape, triangle->marker[1], triangle->marker[2]);
	double reach_m = side_02 + triangle->slack_m;

	for (int p2 = nearby_from(n, n->p_stage_m[p0].x - reach_m);
	     p2 < n->count && n->p_stage_m[p2].x < n->p_stage_m[p0].x + reach_m &&
	     search->poses_left > 0;
	     p2++) {
		if (p2 == p0 || p2 == p1)
			continue;
		double d02 = vec3_distance(n->p_stage_m[p0], n->p_stage_m[p2]);
		double d12 = vec3_distance(n->p_stage_m[p1], n->p_stage_m[p2]);
		if (fabs(d02 - side_02) < triangle->slack_m &&
		    fabs(d12 - side_12) < triangle->slack_m)
			try_points(search, triangle, p0, p1, p2);
	}
}

static void try_triangle(struct search *search, const struct triangle *triangle)
{
	const struct acquire_scratch *s = search->scratch;
	double base_m = side_m(&search->shape, triangle->marker[0], triangle->marker[1]);
	int first = bin_of(base_m - triangle->slack_m), last = bin_of(base_m + triangle->slack_m);

	if (last >= ACQUIRE_BIN_COUNT)
		return;
	for (int k = s->bin_start[first]; k < s->bin_start[last + 1] && search->poses_left > 0;
	     k++) {
		try_base(search, triangle, s->pairs[k].a, s->pairs[k].b);
		try_base(search, triangle, s->pairs[k].b, s->pairs[k].a);
	}
}

static bool wide_enough(const struct shape *shape, const int marker[3])
{
	struct vec3 a = shape->place_m[marker[0]];
	struct vec3 ab = vec3_sub(shape->place_m[marker[1]], a);
	struct vec3 ac = vec3_sub(shape->place_m[marker[2]], a);

	return vec3_norm(ab) > BASE_MIN_M && vec3_norm(ac) > BASE_MIN_M &&
	       0.5 * vec3_norm(vec3_cross(ab, ac)) > AREA_MIN_M2;
}

/* All triangles of the rigid markers. */
static void try_rigid(struct search *search)
{
	int count = search->shape.rigid_count, tried = 0;

	for (int a = 0; a < count; a++)
		for (int b = a + 1; b < count; b++)
			for (int c = b + 1; c < count && tried < TRIANGLES_PER_SHOT; c++) {
				struct triangle triangle = {{a, b, c}, RIGID_SLACK_M};

				if (!wide_enough(&search->shape, triangle.marker))
					continue;
				try_triangle(search, &triangle);
				tried++;
			}
}

/* Some wide triangles over all markers, others in each shot: the cursor walks a fixed sequence that
 * spreads over the layout. */
static void try_skin(struct search *search, uint32_t *cursor)
{
	uint32_t count = (uint32_t)search->shape.count;

	for (int tried = 0; tried < TRIANGLES_PER_SHOT; tried++) {
		uint32_t step = (*cursor)++;
		uint32_t a = step % count, b = (a + 1 + step * 7 % (count - 1)) % count;
		uint32_t c = (b + 1 + step * 13 % (count - 1)) % count;
		struct triangle triangle = {{(int)a, (int)b, (int)c}, SKIN_SLACK_M};

		if (c != a && wide_enough(&search->shape, triangle.marker))
			try_triangle(search, &triangle);
	}
}

/* Points where the head would be: within the reach of its markers from their middle. */
static int count_there(const struct search *search)
{
	const struct shape *shape = &search->shape;
	const struct nearby *n = &search->scratch->free;
	struct vec3 sum_m = {0, 0, 0};
	double reach_m = 0;
	int count = 0;

	for (int i = 0; i < shape->count; i++)
		sum_m = vec3_add(sum_m, shape->place_m[i]);
	struct vec3 middle_m = vec3_scale(sum_m, 1.0 / shape->count);
	for (int i = 0; i < shape->count; i++)
		reach_m = fmax(reach_m, vec3_distance(middle_m, shape->place_m[i]));
	middle_m = pose_apply(&search->best, middle_m);
	for (int k = 0; k < n->count; k++)
		count += vec3_distance(n->p_stage_m[k], middle_m) < reach_m;
	return count;
}

static bool convincing(const struct search *search)
{
	int markers = search->shape.count;
	int least = markers < FOUND_MIN ? markers : FOUND_MIN;

	if (!search->has_best || search->best_found < least ||
	    search->rival_found > RIVAL_SHARE * search->best_found)
		return false;
	int there = count_there(search);
	return search->best_found >= FOUND_SHARE * (there < markers ? there : markers);
}

bool acquire_head(struct acquire_scratch *scratch, struct tracker_state *state, int frame,
		  struct pose *rt_stage_head)
{
	struct search search = {.scratch = scratch, .poses_left = POSES_PER_SHOT};

	if (scratch->free.count < 4)
		return false;
	add_kind(&search.shape, state, frame, true);
	search.shape.rigid_count = search.shape.count;
	add_kind(&search.shape, state, frame, false);
	if (search.shape.count < 3)
		return false;
	try_rigid(&search);
	if (!convincing(&search))
		try_skin(&search, &state->frames[frame].acquire_cursor);
	if (!convincing(&search))
		return false;
	*rt_stage_head = search.best;
	return true;
}
