/*
 * Spots that are not what they seem: markers that touch, and the rim of a glow. The spot is cut at
 * higher and higher levels until it falls into parts that each stand out of the saddle between them
 * by more than noise can; a single spot, however long, never does.
 */
#include <math.h>
#include <string.h>

#include "track/blobs/blobs_parts.h"

#define LARGE_PX 40 /* no marker is so wide */
#define LARGE_PX2 900
#define RUNS_SPARE 1024        /* with fewer left in the table, the image is garbage */
#define LEVEL_COUNT 9          /* levels tried between threshold and peak */
#define PROMINENCE_SIGMA 5     /* of each part over the level that parts them */
#define PROMINENCE_SHARE 0.06f /* of the height, at least: quantisation, lens */

static bool is_large(const struct spot *spot)
{
	return spot->x1 - spot->x0 > LARGE_PX || spot->y1 - spot->y0 > LARGE_PX ||
	       spot->area_px2 > LARGE_PX2;
}

bool spot_is_suspect(const struct spot *spot)
{
	float mean = 0.5f * (spot->area_xx + spot->area_yy);
	float half = 0.5f * (spot->area_xx - spot->area_yy);
	int width = spot->x1 - spot->x0, height = spot->y1 - spot->y0;
	bool wide = (width >= 6) | (height >= 6), sparse = 3 * spot->area_px2 < 2 * width * height;
	bool elongated = half * half + spot->area_xy * spot->area_xy > 0.09f * mean * mean;

	/* Small and not so small ones come in any order; few are suspect. */
	return is_large(spot) || (wide & (elongated | sparse));
}

/* Merges two lists in raster order. */
static uint32_t merge_lists(struct run *runs, uint32_t a, uint32_t b)
{
	uint32_t first = RUN_NONE, *link = &first;

	while (a != RUN_NONE && b != RUN_NONE) {
		uint32_t *least =
			runs[a].y < runs[b].y || (runs[a].y == runs[b].y && runs[a].x0 < runs[b].x0)
				? &a
				: &b;
		uint32_t taken = *least;

		*link = taken;
		link = &runs[taken].next;
		*least = runs[taken].next;
	}
	*link = a != RUN_NONE ? a : b;
	return first;
}

/* Bottom-up merge sort: lists[i] is empty or has 2^i runs. */
static uint32_t sort_runs(struct run *runs, uint32_t first)
{
	uint32_t lists[32], next, sorted = RUN_NONE;

	memset(lists, 0xff, sizeof(lists));
	for (uint32_t r = first; r != RUN_NONE; r = next) {
		uint32_t list = r;
		int i = 0;

		next = runs[r].next;
		runs[r].next = RUN_NONE;
		for (; lists[i] != RUN_NONE; i++) {
			list = merge_lists(runs, lists[i], list);
			lists[i] = RUN_NONE;
		}
		lists[i] = list;
	}
	for (int i = 0; i < 32; i++)
		if (lists[i] != RUN_NONE)
			sorted = merge_lists(runs, lists[i], sorted);
	return sorted;
}

/* Appends what is left of the runs from `r` on above `level`. */
static void cut(struct run_table *table, uint32_t r, const struct grey_image *image, int level)
{
	grey levels[GROUP_PX];

	for (int i = 0; i < GROUP_PX; i++)
		levels[i] = (grey)level;
	run_table_start(table);
	for (; r != RUN_NONE; r = table->runs[r].next) {
		const struct run run = table->runs[r];
		const grey *row = grey_row(image, run.y);

		for (int x = run.x0; x < run.x1; x += GROUP_PX) {
			uint64_t mask = 0;

			for (int i = 0; i < GROUP_PX && x + i < run.x1; i++)
				mask |= (uint64_t)(row[x + i] > level) << i;
			run_table_add(table, run.y, x, mask, levels);
		}
	}
}

/* Noise of one pixel of this grey value. */
static float noise_at(const struct spot_scene *scene, int value)
{
	float sigma = scene->map->noise_sigma;
	float light = (float)value - scene->map->background_median;

	return sqrtf(sigma * sigma +
		     (light > 0 ? light : 0) / (float)scene->settings->electrons_per_grey);
}

/* Sums the spots from `first` on and throws away those that do not stand out of the level by
 * `prominence`. Returns how many stay. */
static int keep_prominent(struct run_table *table, uint32_t first, const struct spot_scene *scene,
			  float prominence)
{
	int count = 0;

	for (uint32_t s = first; s < table->spot_count; s++) {
		struct spot *spot = &table->spots[s];

		if (!spot->area_px2)
			continue;
		spot_sum(spot, table->runs, scene->image);
		if ((float)(spot->peak - spot->level) < prominence)
			spot->area_px2 = 0;
		count += spot->area_px2 > 0;
	}
	return count;
}

/* Cuts spot s at `level`. Returns the number of parts; fewer than `least` leave no trace. */
static int try_level(struct run_table *table, uint32_t s, const struct spot_scene *scene, int level,
		     float prominence, int least)
{
	uint32_t run_count = table->run_count, spot_count = table->spot_count;
	uint32_t runs_lost = table->runs_lost, spots_lost = table->spots_lost;
	int parts;

	cut(table, table->spots[s].first_run, scene->image, level);
	parts = keep_prominent(table, spot_count, scene, prominence);
	if (parts >= least)
		return parts;
	table->run_count = run_count;
	table->spot_count = spot_count;
	table->runs_lost = runs_lost;
	table->spots_lost = spots_lost;
	return 0;
}

/* The k-th level at which a spot is tried. */
static int level_at(const struct spot *spot, int k)
{
	return spot->level + (spot->peak - spot->level) * k / LEVEL_COUNT;
}

bool spot_is_surely_one(const struct spot *spot, const struct grey_image *image)
{
	for (int k = 1; k < LEVEL_COUNT; k++)
		if (level_at(spot, k) != spot->level &&
		    !spot_is_whole(spot, image, level_at(spot, k)))
			return false;
	return true;
}

static bool split_merged(struct run_table *table, uint32_t s, const struct spot_scene *scene)
{
	const struct spot *spot = &table->spots[s];
	float share = PROMINENCE_SHARE * (float)(spot->peak - spot->level);
	uint32_t first = table->spot_count;

	for (int k = 1; k < LEVEL_COUNT; k++) {
		int level = level_at(spot, k);
		float prominence = fmaxf(PROMINENCE_SIGMA * noise_at(scene, level), share);

		if (level == spot->level || spot_is_whole(spot, scene->image, level) ||
		    !try_level(table, s, scene, level, prominence, 2))
			continue;
		table->spots[s].area_px2 = 0;
		for (uint32_t i = first; i < table->spot_count; i++)
			table->spots[i].merged = true;
		return true;
	}
	return false;
}

static int median_value(const struct spot *spot, const struct run *runs,
			const struct grey_image *image)
{
	int bins[GREY_BINS] = {0}, below = 0, bin = 0;

	for (uint32_t r = spot->first_run; r != RUN_NONE; r = runs[r].next)
		for (int x = runs[r].x0; x < runs[r].x1; x++)
			bins[grey_bin(image, grey_row(image, runs[r].y)[x])]++;
	while (2 * (below += bins[bin]) < spot->area_px2)
		bin++;
	return bin << grey_bin_shift(image);
}

/* A glow is gone at the threshold that its own brightness asks for; the spots on it are not. */
static bool split_large(struct run_table *table, uint32_t s, const struct spot_scene *scene)
{
	struct spot *spot = &table->spots[s];
	int median = median_value(spot, table->runs, scene->image), level;
	const int white = grey_white(scene->image);
	float margin = (float)scene->settings->threshold_sigma * noise_at(scene, median);

	level = median + (int)fmaxf(margin, (float)scene->settings->threshold_min);
	if (level < white && try_level(table, s, scene, level, 0, 1)) {
		spot->area_px2 = 0;
		return true;
	}
	if (spot->peak < white)
		spot->area_px2 = 0;
	return !spot->area_px2;
}

/* The runs of a spot that came the short way: a spot without holes, alone in its box. */
static void trace_runs(struct run_table *table, struct spot *spot, const struct grey_image *image)
{
	spot->first_run = table->run_count;
	for (int y = spot->y0; y < spot->y1; y++) {
		const grey *row = grey_row(image, y);
		struct run *run = &table->runs[table->run_count++];
		int x0 = spot->x0, x1 = spot->x1;

		while (row[x0] <= spot->level)
			x0++;
		while (row[x1 - 1] <= spot->level)
			x1--;
		*run = (struct run){(uint16_t)y,           (uint16_t)x0, (uint16_t)x1,
				    (uint16_t)spot->level, SPOT_NONE,    table->run_count};
	}
	spot->last_run = table->run_count - 1;
	table->runs[spot->last_run].next = RUN_NONE;
}

bool spot_split(struct run_table *table, uint32_t s, const struct spot_scene *scene)
{
	struct spot *spot = &table->spots[s];

	if (RUN_MAX - table->run_count < RUNS_SPARE) {
		spot->area_px2 = 0;
		return false;
	}
	if (spot->first_run == RUN_NONE)
		trace_runs(table, spot, scene->image);
	else
		spot->first_run = sort_runs(table->runs, spot->first_run);
	return !(is_large(spot) ? split_large(table, s, scene) : split_merged(table, s, scene));
}
