/*
 * Sorted along x by strips across it, which also say between which entries to search.
 */
#include "track/match/nearby.h"

#include <string.h>

#define FEW 4 /* entries: to pass them by is cheaper than to ask where among them to begin */
#define TORN_CHI2 25.0 /* five sigmas: such views are not of one marker */

/* Of more views than three, those that are of another marker are known. */
static bool is_torn(const struct fix *fix)
{
	return fix->used_count <= 3 && fix->chi2_per_dof > TORN_CHI2;
}

/* Of two places the one farther along x is in no earlier strip. */
static int strip_of(const struct nearby *n, double x_m)
{
	double strips = (x_m - n->x_first_m) * n->strips_per_m;

	return strips > 0 ? (strips < NEARBY_STRIP_COUNT - 1 ? (int)strips : NEARBY_STRIP_COUNT - 1)
			  : 0;
}

/* Shell sort of the entries of a strip: few, unless all points stand in one plane across x. */
static void sort_strip(struct nearby *n, int first, int end)
{
	for (int gap = (end - first) / 2; gap > 0; gap /= 2)
		for (int i = first + gap; i < end; i++) {
			struct vec3 place_m = n->p_stage_m[i];
			int16_t point = n->point[i];
			int k = i;

			for (; k >= first + gap && place_m.x < n->p_stage_m[k - gap].x; k -= gap) {
				n->p_stage_m[k] = n->p_stage_m[k - gap];
				n->point[k] = n->point[k - gap];
			}
			n->p_stage_m[k] = place_m;
			n->point[k] = point;
		}
}

static void measure_strips(struct nearby *n, const struct point *points, const int16_t *chosen)
{
	double first_m = n->count ? INFINITY : 0, last_m = n->count ? -INFINITY : 0;

	for (int k = 0; k < n->count; k++) {
		double x_m = points[chosen[k]].fix.p_stage_m.x;

		first_m = x_m < first_m ? x_m : first_m;
		last_m = x_m > last_m ? x_m : last_m;
	}
	n->x_first_m = first_m;
	n->strips_per_m = last_m > first_m ? NEARBY_STRIP_COUNT / (last_m - first_m) : 0;
}

/* A counting sort into the strips, then each strip by itself. */
static void fill_strips(struct nearby *n, const struct point *points, const int16_t *chosen)
{
	uint16_t *from = n->strip_from, next[NEARBY_STRIP_COUNT];

	memset(from, 0, sizeof(n->strip_from));
	for (int k = 0; k < n->count; k++)
		from[strip_of(n, points[chosen[k]].fix.p_stage_m.x) + 1]++;
	for (int strip = 0; strip < NEARBY_STRIP_COUNT; strip++) {
		next[strip] = from[strip];
		from[strip + 1] += from[strip];
	}
	for (int k = 0; k < n->count; k++) {
		struct vec3 place_m = points[chosen[k]].fix.p_stage_m;
		int place = next[strip_of(n, place_m.x)]++;

		n->p_stage_m[place] = place_m;
		n->point[place] = chosen[k];
	}
	for (int strip = 0; strip < NEARBY_STRIP_COUNT; strip++)
		sort_strip(n, from[strip], from[strip + 1]);
}

void nearby_build(struct nearby *n, const struct point *points, uint32_t point_count,
		  const bool *skip)
{
	int16_t chosen[POINT_MAX];

	n->count = 0;
	for (uint32_t p = 0; p < point_count; p++)
		if (__builtin_popcount(points[p].claimed_mask) >= 3 && !is_torn(&points[p].fix) &&
		    !(skip && skip[p]))
			chosen[n->count++] = (int16_t)p;
	measure_strips(n, points, chosen);
	fill_strips(n, points, chosen);
}

int nearby_from(const struct nearby *n, double x_m)
{
	int strip = strip_of(n, x_m);
	int low = n->strip_from[strip], high = n->strip_from[strip + 1];

	while (high - low > FEW) {
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
