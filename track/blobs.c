/*
 * The blob finder: its memory, and the way of an image through its parts.
 */
#include "track/blobs.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "track/blobs_parts.h"

#define CLEAR_MAX_PX 64 /* no window reaches further */

struct blob_finder {
	struct blob_settings settings;
	int width_px, height_px, group_count;
	blob_scan_fn *scan;
	struct level_map map;
	uint8_t *cells, *group_levels; /* thresholds of the current row */
	struct bright_group *bright;   /* of the current row */
	struct run_table table;
	float clear_px[SPOT_MAX];
};

struct blob_settings blob_settings_default(void)
{
	return (struct blob_settings){.threshold_sigma = 6,
				      .threshold_min = 8,
				      .electrons_per_grey = 40,
				      .area_min_px = 3,
				      .area_max_px = 20000};
}

int blob_finder_create(struct blob_finder **out, int width_px, int height_px,
		       const struct blob_settings *settings)
{
	struct blob_finder *finder = calloc(1, sizeof(*finder));
	size_t groups = (size_t)((width_px + GROUP_PX - 1) / GROUP_PX);

	if (!finder)
		return -ENOMEM;
	finder->settings = *settings;
	finder->width_px = width_px;
	finder->height_px = height_px;
	finder->group_count = (int)groups;
	finder->scan = blob_scan_simd;
	finder->cells = calloc(groups, GROUP_PX);
	finder->group_levels = calloc(groups, CELL_PX);
	finder->bright = calloc(groups, sizeof(*finder->bright));
	if (!finder->cells || !finder->group_levels || !finder->bright ||
	    level_map_init(&finder->map, width_px, height_px))
		goto fail;
	*out = finder;
	return 0;
fail:
	blob_finder_destroy(finder);
	return -ENOMEM;
}

void blob_finder_destroy(struct blob_finder *finder)
{
	if (!finder)
		return;
	level_map_finish(&finder->map);
	free(finder->bright);
	free(finder->group_levels);
	free(finder->cells);
	free(finder);
}

/* The last pixels of a row that do not fill a group: scanned in a copy padded with black. */
static int scan_tail(struct blob_finder *finder, const uint8_t *row, struct bright_group *out)
{
	size_t whole = (size_t)finder->width_px / GROUP_PX;
	uint8_t padded[GROUP_PX] = {0};
	int count;

	memcpy(padded, row + whole * GROUP_PX, (size_t)finder->width_px % GROUP_PX);
	count = finder->scan(padded, finder->cells + whole * GROUP_PX,
			     finder->group_levels + whole * CELL_PX, 1, out);
	out->group = (uint32_t)whole;
	return count;
}

static void scan_image(struct blob_finder *finder, const struct grey_image *image)
{
	int whole = finder->width_px / GROUP_PX;

	for (int y = 0; y < finder->height_px; y++) {
		const uint8_t *row = image->pixels + (ptrdiff_t)y * image->stride_bytes;
		int count;

		if (y % CELL_PX == 0)
			level_map_row(&finder->map, y / CELL_PX, finder->cells,
				      finder->group_levels);
		count = finder->scan(row, finder->cells, finder->group_levels, whole,
				     finder->bright);
		if (whole < finder->group_count)
			count += scan_tail(finder, row, finder->bright + count);
		if (count)
			run_table_add_row(&finder->table, y, finder->bright, count, finder->cells);
	}
}

/* Distance from the middle of `spot` to where `other` begins, its faint border included. */
static float gap_px(const struct spot *spot, const struct spot *other)
{
	float x = 0.5f * (float)(spot->x0 + spot->x1 - 1),
	      y = 0.5f * (float)(spot->y0 + spot->y1 - 1);
	float dx = fmaxf((float)(other->x0 - 1) - x, x - (float)other->x1);
	float dy = fmaxf((float)(other->y0 - 1) - y, y - (float)other->y1);

	return hypotf(fmaxf(dx, 0), fmaxf(dy, 0));
}

/* Spots come in order of their top rows, so only the next few can be near. */
static void find_clearances(struct blob_finder *finder)
{
	const struct spot *spots = finder->table.spots;
	float *clear_px = finder->clear_px;

	for (uint32_t i = 0; i < finder->table.spot_count; i++)
		clear_px[i] = CLEAR_MAX_PX;
	for (uint32_t i = 0; i < finder->table.spot_count; i++)
		for (uint32_t j = i + 1;
		     j < finder->table.spot_count && spots[j].y0 < spots[i].y1 + CLEAR_MAX_PX;
		     j++) {
			clear_px[i] = fminf(clear_px[i], gap_px(&spots[i], &spots[j]));
			clear_px[j] = fminf(clear_px[j], gap_px(&spots[j], &spots[i]));
		}
}

static void measure_spots(struct blob_finder *finder, const struct grey_image *image,
			  struct blob_set *set)
{
	struct run_table *table = &finder->table;
	struct spot_scene scene = {
		.image = image, .map = &finder->map, .settings = &finder->settings};

	set->blob_count = 0;
	set->blobs_lost = table->runs_lost + table->spots_lost;
	for (uint32_t s = 0; s < table->spot_count; s++) {
		if (set->blob_count == BLOB_MAX) {
			set->blobs_lost += table->spot_count - s;
			break;
		}
		scene.clear_px = finder->clear_px[s];
		set->blob_count += spot_measure(&table->spots[s], table->runs, &scene,
						&set->blobs[set->blob_count]);
	}
}

void blob_finder_run(struct blob_finder *finder, const struct grey_image *image,
		     struct blob_set *set)
{
	struct run_table *table = &finder->table;

	table->run_count = table->runs_lost = table->spot_count = table->spots_lost = 0;
	level_map_measure(&finder->map, image, &finder->settings);
	scan_image(finder, image);
	run_table_join(table, 0, image);
	find_clearances(finder);
	measure_spots(finder, image, set);
}
