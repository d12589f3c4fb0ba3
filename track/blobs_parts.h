/*
 * The blob finder's inner parts, in the order in which an image passes through them:
 * level map -> scan -> join -> (split) -> centroid. For track/blobs*.c and their tests only.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "track/blobs.h"

#define CELL_PX 16  /* the threshold is constant over one cell */
#define GROUP_PX 64 /* the scan looks at so many pixels at once */
#define CELLS_PER_GROUP (GROUP_PX / CELL_PX)
#define RUN_MAX 32768 /* per image; runs past it are counted as lost */
#define SPOT_MAX 4096 /* per image, hot pixels included; past it they are counted as lost */

/* Background and threshold at nodes GROUP_PX apart: node (i, j) stands in the middle of cell
 * (4 i, 4 j); between the nodes both are interpolated. */
struct level_map {
	int x_count, y_count;
	float *background; /* [y_count][x_count], grey values */
	uint8_t *limit;    /* [y_count][x_count][CELL_PX], the threshold, repeated */
	uint16_t *noise;   /* [y_count][x_count], sums of differences */
	float background_median;
	float noise_sigma; /* grey values, at background_median, quantisation included */
};

int level_map_init(struct level_map *map, int width_px, int height_px);
void level_map_finish(struct level_map *map);
void level_map_measure(struct level_map *map, const struct grey_image *image,
		       const struct blob_settings *settings);

/* Thresholds of the cell row `cell_y`: one per pixel (`cells`), and per group the lowest of its
 * cells, repeated CELL_PX times (`groups`). */
void level_map_row(const struct level_map *map, int cell_y, uint8_t *cells, uint8_t *groups);

/* The background as a plane around (x, y): value and slopes. `curve` says how far the map is from
 * a plane there, in grey values. */
struct plane {
	float value, slope_x, slope_y, curve;
};
struct plane level_map_plane(const struct level_map *map, float x_px, float y_px);

/* A group of GROUP_PX pixels with bright ones in it; bit b = pixel 64 * group + b. */
struct bright_group {
	uint32_t group;
	uint64_t mask;
};

/* Groups of one row (of group_count * GROUP_PX pixels) with pixels above `cells`; returns how many.
 * The two give the same bits. */
typedef int blob_scan_fn(const uint8_t *row, const uint8_t *cells, const uint8_t *groups,
			 int group_count, struct bright_group *out);
blob_scan_fn blob_scan_simd, blob_scan_plain;

/* Pixels [x0, x1) of row y, all above the level. */
struct run {
	uint16_t y, x0, x1;
	uint8_t level;
	uint32_t parent; /* union-find, towards the first run; later the spot's number */
	uint32_t next;   /* of the same spot, in raster order; RUN_NONE ends */
};
#define RUN_NONE UINT32_MAX

/* A connected set of runs and its sums over (I - level). */
struct spot {
	uint32_t first_run, last_run;
	int x0, x1, y0, y1; /* half open */
	int level;          /* highest threshold of its runs */
	int area_px2, peak, saturated_count;
	int64_t sum, sum_x, sum_y; /* about pixel (0,0) */
	bool merged;
};

struct run_table {
	uint32_t run_count, runs_lost;
	uint32_t spot_count, spots_lost;
	struct run runs[RUN_MAX];
	struct spot spots[SPOT_MAX];
};

/* Adds the runs of one row; rows come from top to bottom. */
void run_table_add_row(struct run_table *table, int y, const struct bright_group *groups,
		       int group_count, const uint8_t *cells);

/* Joins runs [first, run_count), in raster order, where they touch (8 neighbours), appends a spot
 * for each connected set and sums up. */
void run_table_join(struct run_table *table, uint32_t first, const struct grey_image *image);

/* What is known of one spot's surroundings when its centroid is sought. */
struct spot_scene {
	const struct grey_image *image;
	const struct level_map *map;
	const struct blob_settings *settings;
	float clear_px; /* radius around the spot's middle that no other spot reaches */
};

/* Returns false when the spot is a hot pixel or noise. Sets all of `out`. */
bool spot_measure(const struct spot *spot, const struct run *runs, const struct spot_scene *scene,
		  struct blob *out);
