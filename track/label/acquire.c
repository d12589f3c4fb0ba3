/*
 * Triangle search for heads. Pairs of points are sorted by distance once, so that a side of the
 * layout's triangle finds its candidates at once.
 */
#include "track/label/acquire.h"

#include <math.h>
#include <string.h>

#include "track/head.h"

#define RIGID_SLACK_M 0.002 /* of a distance between rigid markers: how well a jig is measured */
#define SKIN_SLACK_M 0.004  /* ... and between skin markers: expressions */
#define RIGID_NEAR_M 0.0025 /* a rigid marker this near to a point is found */
#define SKIN_NEAR_M 0.007
#define BASE_MIN_M 0.04 /* sides of a useful triangle */
#define AREA_MIN_M2 2e-4
#define TRIANGLES_PER_SHOT 40
#define POSES_PER_SHOT 2000
#define FOUND_MIN 6      /* markers on points, at least ... */
#define FOUND_SHARE 0.6  /* ... and of all markers or points there, whichever is fewer */
#define RIVAL_SHARE 0.85 /* another pose that finds this share as many makes it ambiguous */
#define SAME_POSE_M 0.01
#define SAME_PLACE_M 0.15
#define FEW 15 /* so many markers are tried first; fewer than the next are plainly wrong */
#define AGREE_MIN 4

struct triangle {
	int marker[3];
	double slack_m;
};

/* The markers of a head. */
struct shape {
	int count, rigid_count;
	struct vec3 place_m[LABEL_MAX]; /* the rigid ones first */
};

/* Where a face seems to be. */
struct place {
	int best_found, rival_found;
	struct pose best;
};

struct search {
	const struct acquire_scratch *scratch;
	struct shape shape;
	int poses_left;
	int place_count;
	struct place places[ACQUIRE_PLACE_MAX];
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
		if (i == FEW && found < AGREE_MIN)
			return 0;
	}
	return found;
}

static void weigh_at(struct place *place, const struct pose *pose, int found)
{
	bool same = head_distance_m(pose, &place->best) < SAME_POSE_M;

	if (found > place->best_found) {
		if (!same)
			place->rival_found = place->best_found;
		place->best_found = found;
		place->best = *pose;
	} else if (!same && found > place->rival_found) {
		place->rival_found = found;
	}
}

static void weigh_pose(struct search *search, const struct pose *pose)
{
	int found = count_found(search, pose), k = 0;

	if (found < AGREE_MIN)
		return;
	while (k < search->place_count &&
	       vec3_distance(pose->t, search->places[k].best.t) > SAME_PLACE_M)
		k++;
	if (k < search->place_count)
		weigh_at(&search->places[k], pose, found);
	else if (k < ACQUIRE_PLACE_MAX)
		search->places[search->place_count++] = (struct place){found, 0, *pose};
}

/* Axes along the first side and across the triangle. */
static struct pose triangle_axes(struct vec3 p0, struct vec3 p1, struct vec3 p2)
{
	struct vec3 x = vec3_unit(vec3_sub(p1, p0));
	struct vec3 z = vec3_unit(vec3_cross(x, vec3_sub(p2, p0)));
	struct vec3 y = vec3_cross(z, x);

	return (struct pose){{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}, p0};
}

static void try_points(struct search *search, const struct triangle *triangle, int p0, int p1,
		       int p2)
{
	const struct vec3 *points = search->scratch->free.p_stage_m;
	const struct vec3 *places = search->shape.place_m;
	const int *marker = triangle->marker;
	struct pose to = triangle_axes(points[p0], points[p1], points[p2]);
	struct pose from = triangle_axes(places[marker[0]], places[marker[1]], places[marker[2]]);
	struct pose back = pose_inverse(&from), pose = pose_compose(&to, &back);

	search->poses_left--;
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

/* All triangles of the rigid markers, first with one and in the next shot with another. */
static void try_rigid(struct search *search, uint32_t first)
{
	int count = search->shape.rigid_count, tried = 0;

	for (int turn = 0; turn < count; turn++)
		for (int b = 1; b < count; b++)
			for (int c = b + 1; c < count && tried < TRIANGLES_PER_SHOT; c++) {
				int a = (int)((first + (uint32_t)turn) % (uint32_t)count);
				struct triangle triangle = {{a, (a + b) % count, (a + c) % count},
							    RIGID_SLACK_M};

				/* each triangle once: its lowest corner leads */
				if (triangle.marker[1] < a || triangle.marker[2] < a ||
				    !wide_enough(&search->shape, triangle.marker))
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
static int count_there(const struct search *search, const struct pose *pose)
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
	middle_m = pose_apply(pose, middle_m);
	for (int k = 0; k < n->count; k++)
		count += vec3_distance(n->p_stage_m[k], middle_m) < reach_m;
	return count;
}

static bool convincing(const struct search *search, const struct place *place)
{
	int markers = search->shape.count;
	int least = markers < FOUND_MIN ? markers : FOUND_MIN;

	if (place->best_found < least || place->rival_found > RIVAL_SHARE * place->best_found)
		return false;
	int there = count_there(search, &place->best);
	return place->best_found >= FOUND_SHARE * (there < markers ? there : markers);
}

static int collect(const struct search *search, struct pose rt_stage_head[ACQUIRE_PLACE_MAX])
{
	int count = 0;

	for (int k = 0; k < search->place_count; k++)
		if (convincing(search, &search->places[k]))
			rt_stage_head[count++] = search->places[k].best;
	return count;
}

int acquire_heads(const struct acquire_scratch *scratch, struct tracker_state *state, int frame,
		  struct pose rt_stage_head[ACQUIRE_PLACE_MAX])
{
	struct search search = {.scratch = scratch, .poses_left = POSES_PER_SHOT};
	uint32_t *cursor = &state->frames[frame].acquire_cursor;

	add_kind(&search.shape, state, frame, true);
	search.shape.rigid_count = search.shape.count;
	add_kind(&search.shape, state, frame, false);
	if (scratch->free.count < 4 || search.shape.count < 3)
		return 0;
	try_rigid(&search, *cursor);
	int count = collect(&search, rt_stage_head);
	if (count > 0)
		return count;
	try_skin(&search, cursor);
	return collect(&search, rt_stage_head);
}
