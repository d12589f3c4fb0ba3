/*
 * Shell sort along x; strips say between which entries to search.
 */
#include "track/match/nearby.h"

#define TORN_CHI2 25.0 /* five sigmas: such views are not of one marker */

/* Of more views than three, those that are of another marker are known. */
static bool is_torn(const struct fix *fix)
{
	return fix->used_count == 3 && fix->chi2_per_dof > TORN_CHI2;
}

static void sort_by_x(struct nearby *n)
{
	for (int gap = n->count / 2; gap > 0; gap /= 2)
		for (int i = gap; i < n->count; i++) {
			struct vec3 place_m = n->p_stage_m[i];
			int16_t point = n->point[i];
			int k = i;

			for (; k >= gap && place_m.x < n->p_stage_m[k - gap].x; k -= gap) {
				n->p_stage_m[k] = n->p_stage_m[k - gap];
				n->point[k] = n->point[k - gap];
			}
			n->p_stage_m[k] = place_m;
			n->point[k] = point;
		}
}

/* Of two places the one farther along x is in no earlier strip. */
static int strip_of(const struct nearby *n, double x_m)
{
	double strips = (x_m - n->x_first_m) * n->strips_per_m;

	return strips > 0 ? (strips < NEARBY_STRIP_COUNT - 1 ? (int)strips : NEARBY_STRIP_COUNT - 1)
			  : 0;
}

static void index_strips(struct nearby *n)
{
	int strip = 0;

	n->x_first_m = n->count ? n->p_stage_m[0].x : 0;
	double width_m = n->count ? n->p_stage_m[n->count - 1].x - n->x_first_m : 0;
	n->strips_per_m = width_m > 0 ? NEARBY_STRIP_COUNT / width_m : 0;
	for (int k = 0; k < n->count; k++)
		for (int its = strip_of(n, n->p_stage_m[k].x); strip <= its; strip++)
			n->strip_from[strip] = (uint16_t)k;
	for (; strip <= NEARBY_STRIP_COUNT; strip++)
		n->strip_from[strip] = (uint16_t)n->count;
}

void nearby_build(struct nearby *n, const struct point *points, uint32_t point_count,
		  const bool *skip)
{
	n->count = 0;
	for (uint32_t p = 0; p < point_count; p++) {
		if (__builtin_popcount(points[p].claimed_mask) < 3 || is_torn(&points[p].fix) ||
		    (skip && skip[p]))
			continue;
		n->p_stage_m[n->count] = points[p].fix.p_stage_m;
		n->point[n->count++] = (int16_t)p;
	}
	sort_by_x(n);
	index_strips(n);
}

int nearby_from(const struct nearby *n, double x_m)
{
	int strip = strip_of(n, x_m);
	int low = n->strip_from[strip], high = n->strip_from[strip + 1];

	while (low < high) {
		int middle = (low + high) / 2;

		if (n->p_stage_m[middle].x < x_m)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

int nearby_nearest(const struct nearby *n, struct vec3 place_m, double radius_m,
		   double *distance2_m2)
{
	int best = -1;

	*distance2_m2 = radius_m * radius_m;
	for (int k = nearby_from(n, place_m.x - radius_m);
	     k < n->count && n->p_stage_m[k].x <= place_m.x + radius_m; k++) {
		struct vec3 d = vec3_sub(n->p_stage_m[k], place_m);
		double d2 = vec3_dot(d, d);

		if (d2 < *distance2_m2) {
			*distance2_m2 = d2;
			best = k;
		}
	}
	return best;
}
