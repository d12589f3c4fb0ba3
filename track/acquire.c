/*
 * Triangle search for the head. Distances between pairs of points are sorted once, so that a side
 * of the layout's triangle is a binary search.
 */
#include "track/acquire.h"

#include <math.h>

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
#define FOUND_SHARE 0.6  /* ... and of all markers or points, whichever is fewer */
#define RIVAL_SHARE 0.85 /* another pose that finds this share as many makes it ambiguous */
#define SAME_POSE_M 0.01

struct triangle {
	int marker[3];
	double slack_m;
};

struct search {
	const struct acquire_scratch *scratch;
	const struct layout *layout;
	int poses_left;
	bool has_best;
	int best_found, rival_found;
	struct pose best;
};

static int by_distance(const void *a, const void *b)
{
	const struct acquire_pair *pa = a, *pb = b;

	if (pa->distance_m != pb->distance_m)
		return pa->distance_m < pb->distance_m ? -1 : 1;
	return pa->a != pb->a ? pa->a - pb->a : pa->b - pb->b;
}

/* Heap sort: qsort may allocate. */
static void sort_pairs(struct acquire_pair *pairs, int count)
{
	for (int end = count, start = count / 2; end > 1;) {
		struct acquire_pair moving;

		if (start > 0) {
			moving = pairs[--start];
		} else {
			moving = pairs[--end];
			pairs[end] = pairs[0];
		}
		int root = start;
		for (int child; (child = 2 * root + 1) < end; root = child) {
			if (child + 1 < end && by_distance(&pairs[child], &pairs[child + 1]) < 0)
				child++;
			if (by_distance(&moving, &pairs[child]) >= 0)
				break;
			pairs[root] = pairs[child];
		}
		pairs[root] = moving;
	}
}

/* The best confirmed points first: those that most cameras see. */
static void collect_points(struct acquire_scratch *s, const struct point *points, uint32_t count)
{
	s->point_count = 0;
	for (int views = CAMERA_MAX; views >= 3; views--)
		for (uint32_t i = 0; i < count && s->point_count < ACQUIRE_POINT_MAX; i++)
			if (points[i].fix.used_count == views)
				s->points_stage_m[s->point_count++] = points[i].fix.p_stage_m;
	s->pair_count = 0;
	for (int a = 0; a < s->point_count; a++)
		for (int b = a + 1; b < s->point_count; b++)
			s->pairs[s->pair_count++] = (struct acquire_pair){
				(float)vec3_distance(s->points_stage_m[a], s->points_stage_m[b]),
				(uint16_t)a, (uint16_t)b};
	sort_pairs(s->pairs, s->pair_count);
}

static int first_pair_from(const struct acquire_scratch *s, double distance_m)
{
	int low = 0, high = s->pair_count;

	while (low < high) {
		int middle = (low + high) / 2;

		if (s->pairs[middle].distance_m < distance_m)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static double nearest_point_m(const struct acquire_scratch *s, struct vec3 p)
{
	double best2 = INFINITY;

	for (int i = 0; i < s->point_count; i++) {
		struct vec3 d = vec3_sub(s->points_stage_m[i], p);
		double d2 = vec3_dot(d, d);

		if (d2 < best2)
			best2 = d2;
	}
	return sqrt(best2);
}

/* How many markers of the layout lie on a point. Gives up early on what is plainly wrong. */
static int count_found(const struct search *search, const struct pose *pose)
{
	const struct layout *layout = search->layout;
	int found = 0;

	for (uint32_t i = 0; i < layout->marker_count; i++) {
		const struct layout_marker *marker = &layout->markers[i];
		double near_m =
			nearest_point_m(search->scratch, pose_apply(pose, marker->neutral_m));

		found += near_m < (marker->rigid ? RIGID_NEAR_M : SKIN_NEAR_M);
		if (i == 15 && found < 3)
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
	const struct layout_marker *markers = search->layout->markers;
	const struct vec3 *points = search->scratch->points_stage_m;
	int chosen[3] = {p0, p1, p2};
	struct rigid_pair pairs[3];
	struct pose pose;

	for (int i = 0; i < 3; i++)
		pairs[i] = (struct rigid_pair){markers[triangle->marker[i]].neutral_m,
					       points[chosen[i]], 1};
	search->poses_left--;
	if (!rigid_fit(pairs, 3, &pose))
		weigh_pose(search, &pose);
}

static double side_m(const struct layout *layout, int a, int b)
{
	return vec3_distance(layout->markers[a].neutral_m, layout->markers[b].neutral_m);
}

/* The side 0-1 is on points (p0, p1): which third points fit the other two sides? */
static void try_base(struct search *search, const struct triangle *triangle, int p0, int p1)
{
	const struct acquire_scratch *s = search->scratch;
	double side_02 = side_m(search->layout, triangle->marker[0], triangle->marker[2]);
	double side_12 = side_m(search->layout, triangle->marker[1], triangle->marker[2]);

	for (int p2 = 0; p2 < s->point_count && search->poses_left > 0; p2++) {
		if (p2 == p0 || p2 == p1)
			continue;
		double d02 = vec3_distance(s->points_stage_m[p0], s->points_stage_m[p2]);
		double d12 = vec3_distance(s->points_stage_m[p1], s->points_stage_m[p2]);
		if (fabs(d02 - side_02) < triangle->slack_m &&
		    fabs(d12 - side_12) < triangle->slack_m)
			try_points(search, triangle, p0, p1, p2);
	}
}

static void try_triangle(struct search *search, const struct triangle *triangle)
{
	const struct acquire_scratch *s = search->scratch;
	double base_m = side_m(search->layout, triangle->marker[0], triangle->marker[1]);

	for (int k = first_pair_from(s, base_m - triangle->slack_m);
	     k < s->pair_count && s->pairs[k].distance_m < base_m + triangle->slack_m &&
	     search->poses_left > 0;
	     k++) {
		try_base(search, triangle, s->pairs[k].a, s->pairs[k].b);
		try_base(search, triangle, s->pairs[k].b, s->pairs[k].a);
	}
}

static bool wide_enough(const struct layout *layout, const int marker[3])
{
	struct vec3 a = layout->markers[marker[0]].neutral_m;
	struct vec3 ab = vec3_sub(layout->markers[marker[1]].neutral_m, a);
	struct vec3 ac = vec3_sub(layout->markers[marker[2]].neutral_m, a);

	return vec3_norm(ab) > BASE_MIN_M && vec3_norm(ac) > BASE_MIN_M &&
	       0.5 * vec3_norm(vec3_cross(ab, ac)) > AREA_MIN_M2;
}

/* All triangles of the rigid markers. */
static void try_rigid(struct search *search)
{
	int rigid[LABEL_MAX], count = 0, tried = 0;

	for (uint32_t i = 0; i < search->layout->marker_count; i++)
		if (search->layout->markers[i].rigid)
			rigid[count++] = (int)i;
	for (int a = 0; a < count; a++)
		for (int b = a + 1; b < count; b++)
			for (int c = b + 1; c < count && tried < TRIANGLES_PER_SHOT; c++) {
				struct triangle triangle = {{rigid[a], rigid[b], rigid[c]},
							    RIGID_SLACK_M};

				if (!wide_enough(search->layout, triangle.marker))
					continue;
				try_triangle(search, &triangle);
				tried++;
			}
}

/* Some wide triangles over all markers, others in each shot: the cursor walks a fixed sequence that
 * spreads over the layout. */
static void try_skin(struct search *search, uint32_t *cursor)
{
	uint32_t count = search->layout->marker_count;

	for (int tried = 0; tried < TRIANGLES_PER_SHOT; tried++) {
		uint32_t step = (*cursor)++;
		uint32_t a = step % count, b = (a + 1 + step * 7 % (count - 1)) % count;
		uint32_t c = (b + 1 + step * 13 % (count - 1)) % count;
		struct triangle triangle = {{(int)a, (int)b, (int)c}, SKIN_SLACK_M};

		if (c != a && wide_enough(search->layout, triangle.marker))
			try_triangle(search, &triangle);
	}
}

static bool convincing(const struct search *search)
{
	int markers = (int)search->layout->marker_count;
	int fewer = search->scratch->point_count < markers ? search->scratch->point_count : markers;
	int least = markers < FOUND_MIN ? markers : FOUND_MIN;

	return search->has_best && search->best_found >= least &&
	       search->best_found >= FOUND_SHARE * fewer &&
	       search->rival_found <= RIVAL_SHARE * search->best_found;
}

bool acquire_head(struct acquire_scratch *scratch, const struct layout *layout,
		  const struct point *points, uint32_t point_count, uint32_t *cursor,
		  struct pose *rt_stage_head)
{
	struct search search = {scratch, layout, .poses_left = POSES_PER_SHOT};

	collect_points(scratch, points, point_count);
	if (scratch->point_count < 4)
		return false;
	try_rigid(&search);
	if (!convincing(&search))
		try_skin(&search, cursor);
	if (!convincing(&search))
		return false;
	*rt_stage_head = search.best;
	return true;
}
