/*
 * The blob finder's inner parts, in the order in which an image passes through them:
 * level map -> scan -> join -> (split) -> centroid. For track/blobs/blobs*.c and their tests only.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "track/blobs/blobs.h"

#include "track/blobs/blobs_builds.h"

#ifdef BLOBS_DEEP
#include "track/blobs/blobs_grey16.h"
#else
#include "track/blobs/blobs_grey8.h"
#endif

#define CELL_PX 16 /* the threshold is constant over one cell */
#define NODE_REACH_PX (2 * CELL_PX)
#define GROUP_PX 64 /* the scan looks at so many pixels at once */
#define CELLS_PER_GROUP (GROUP_PX / CELL_PX)
#define BACKGROUND_SPAN 80 /* 256ths; nodes further above the median than this lie on a lamp */
#define SURVEY_ROWS 4      /* rows of nodes that are measured before the scan */
#define PATCH_PX 16
#define PATCH_ABOVE 2
#define PATCH_BORDER_PX 2 /* dark pixels that a patch must have on all sides */
#define MEASURE_LAG_ROWS (PATCH_PX - PATCH_ABOVE + 1) /* from the scan's front to the last run */
#define RUN_MAX 32768 /* per image; runs past it are counted as lost */
#define SPOT_MAX 4096 /* per image, hot pixels included; past it they are counted as lost */

/* Pixels that will be read next, asked for in small portions while the finder computes: otherwise
 * memory would rest meanwhile, and the scan wait for it afterwards. */
struct feed {
	const uint8_t *next, *end; /* bytes not yet asked for */
};

#define FEED_BYTES 640
#define LINE_BYTES 64
#define FEED_ROWS 24

/* Pixels that the scan asks for in time, further ahead than the processor does by itself. */
#define SCAN_AHEAD_BYTES 2560

static inline void scan_expect(const grey *groups, size_t count)
{
	for (size_t i = 0; i < count * GROUP_PX * sizeof(grey); i += LINE_BYTES)
		__builtin_prefetch((const uint8_t *)groups + SCAN_AHEAD_BYTES + i);
}

static inline void feed_on(struct feed *feed)
{
	if (feed->next >= feed->end)
		return;
	for (int i = 0; i < FEED_BYTES; i += LINE_BYTES)
		__builtin_prefetch(feed->next + i);
	feed->next += FEED_BYTES;
}

/* Background and threshold at a node, from the row of pixels through it. */
struct level_node {
	uint32_t epoch;   /* of the image it was measured in */
	float background; /* grey values */
	uint16_t limit;   /* the threshold: what is above is bright */
};

/* Nodes stand GROUP_PX apart in x and CELL_PX in y: node (i, j) at pixel (64 i + 7.5, 16 j + 7.5).
 * One is measured when it is first needed, which in the dark is never. */
struct level_map {
	int x_count, y_count;
	const struct grey_image *image; /* during one run, borrowed */
	uint32_t epoch;                 /* counts images; says only which nodes are known */
	struct level_node *nodes;       /* [y_count][x_count] */
	int survey_y[SURVEY_ROWS];      /* top rows of the cell rows surveyed */
	uint16_t *survey;               /* [SURVEY_ROWS][x_count], backgrounds, rounded */
	float background_median;
	float noise_sigma; /* grey values, at background_median, quantisation included */
	float margin[BACKGROUND_SPAN + 1]; /* threshold over background, so far above the median */
};

/* Starts a new image: its median background and noise, from SURVEY_ROWS rows of nodes. */
void level_map_start(struct level_map *map, const struct grey_image *image,
		     const struct blob_settings *settings);

/* The nodes of this cell row will be asked for soon. */
void level_map_expect(const struct level_map *map, int cell_y);

/* Levels that nothing dark exceeds and every spot does, one per group, repeated CELL_PX times, good
 * from row y on; returns the row where they end. */
int level_map_coarse(const struct level_map *map, int y, grey *groups);

/* Thresholds of the group's cells in the cell row `cell_y`, one per pixel. */
void level_map_cells(const struct level_map *map, int cell_y, int group, grey cells[GROUP_PX]);

/* The background as a plane around some point: grey values there, and per pixel. */
struct plane {
	float value, slope_x, slope_y;
};

/* The background around (x, y); looks at pixels up to NODE_REACH_PX below. */
struct plane level_map_plane(const struct level_map *map, float x_px, float y_px);

/* Row y; all rows begin at an even address when pixels are words. */
static inline const grey *grey_row(const struct grey_image *image, int y)
{
	return (const grey *)(const void *)(image->pixels + (ptrdiff_t)y * image->stride_bytes);
}

/* Batcher's merge sort of eight, less what does not reach the middle. */
static const uint8_t median_net[][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
					{4, 6}, {5, 7}, {1, 2}, {5, 6}, {0, 4}, {1, 5},
					{2, 6}, {3, 7}, {2, 4}, {3, 5}, {3, 4}};
#define MEDIAN_NET_COUNT (sizeof(median_net) / sizeof(median_net[0]))

/* The background at node (i, j): the mean of 16 medians of 8 pixels each, side by side around it;
 * an outlier area must cover a third of them to be felt. */
float sample_level(const struct grey_image *image, int i, int j);

/* Those of nodes (i, j) and (i + 1, j). */
void sample_two_levels(const struct grey_image *image, int i, int j, float out[2]);

#define DIFFERENCE_COUNT 28

/* Sum of DIFFERENCE_COUNT differences of pixels two apart around a node, where no lens blur ties
 * them. */
int sample_noise(const struct grey_image *image, int i, int j);

/* A row of pixels through the nodes of cell row j. */
static inline const grey *sampled_row(const struct grey_image *image, int j)
{
	int y = CELL_PX * j + CELL_PX / 2;

	return grey_row(image, y < image->height_px ? y : image->height_px - 1);
}

/* A group of pixels that may hold something bright. */
struct candidate {
	uint16_t y, group;
};

/* Writes the groups of row y that hold a pixel above the group's level (CELL_PX times the same) and
 * returns how many; `out` has room for all. */
size_t blob_scan(const grey *row, int y, const grey *levels, int group_count,
		 struct candidate *out);

/* Bit b of the result: pixel b of the group is above level[b]. */
uint64_t blob_mask(const grey *pixels, const grey *level);

/* The same of `row_count` rows, all masks together. */
uint64_t blob_mask_rows(const grey *pixels, ptrdiff_t stride_bytes, int row_count,
			const grey *level);

/* Pixels [x0, x1) of row y, all above the level. */
struct run {
	uint16_t y, x0, x1, level;
	uint32_t spot; /* or SPOT_NONE; ask spot_root() */
	uint32_t next; /* of the same spot; RUN_NONE ends */
};
#define RUN_NONE UINT32_MAX
#define SPOT_NONE UINT32_MAX

/* Sums over the pixels of a set of runs, each counting once: of 2 x, y and their products (2 x is
 * whole in the middle of a run), and of the runs' lengths cubed. */
struct area_sums {
	int64_t x, y, xx, xy, yy, cubes;
};

/* A connected set of runs. w, wx, wy are sums over the weights I - level, about pixel (x0, y0). */
struct spot {
	uint32_t parent;              /* itself, or the older spot that it grew into */
	uint32_t first_run, last_run; /* RUN_NONE: one run in each row, the pixels above level */
	int x0, x1, y0, y1;           /* half open */
	int level;                    /* highest threshold of its runs */
	int area_px2;                 /* 0: taken apart or thrown away */
	int peak;
	bool merged;
	float clear_px; /* around the middle; 0 = not yet looked for, and not yet summed */
	float area_xx, area_xy, area_yy; /* second central moments of the area, px2 */
	int64_t w, wx, wy;
	struct area_sums area;
};

/* The pixels of a spot that went the short way. They are read again when the image's own lines have
 * left the first cache: fetching them back would disturb the processor's reading ahead. */
#define COPY_COUNT 64 /* more than wait to be measured */
struct patch_copy {
	uint32_t spot; /* whose copy it is, or SPOT_NONE */
	int x0, y0;
	uint8_t pixels[PATCH_PX * PATCH_PX];
};

struct run_table {
	uint32_t run_count, runs_lost;
	uint32_t spot_count, spots_lost;
	int row_y;          /* of the last run joined */
	uint32_t row_first; /* its row's first run */
	uint32_t above;     /* runs of the row above before this one lie to the left */
	struct patch_copy copies[COPY_COUNT]; /* of spot s in place s mod COPY_COUNT */
	struct run runs[RUN_MAX];
	struct spot spots[SPOT_MAX];
};

/* Starts a set of spots that touches no earlier one. */
void run_table_start(struct run_table *table);

/* Adds the runs of pixels [x, x + GROUP_PX) of row y and joins them to what they touch (8
 * neighbours); in raster order. `level` is of pixel x on. */
void run_table_add(struct run_table *table, int y, int x, uint64_t mask, const grey *level);

/* Empties the table. */
void run_table_reset(struct run_table *table);

/* The short way for a small spot that stands alone: (x, y) is the middle of its first run, `level`
 * its threshold. Looks at PATCH_PX pixels square around it, PATCH_ABOVE rows above the first; when
 * they hold one spot without holes and nothing else, appends it, summed, and returns true. */
bool run_table_add_patch(struct run_table *table, const struct grey_image *image, int x, int y,
			 grey level, struct feed *feed);

/* Whether the spot is surely one above this level; false: it must be looked at. */
bool spot_is_whole(const struct spot *spot, const struct grey_image *image, int level);

void spot_add_area(struct area_sums *sums, int64_t y, int64_t x0, int64_t x1);
void spot_area_moments(struct spot *spot);

uint32_t spot_root(struct run_table *table, uint32_t spot);

/* All sums of the spot that is alone in its patch, from the patch's copy. */
void spot_sum_patch(struct spot *spot, const struct patch_copy *copy);

/* The light of a spot: w, wx, wy and the peak. Returns false when it is too large for this way. */
bool spot_sum_short(struct spot *spot, const struct run *runs, const struct grey_image *image);

/* Fills the sums of a spot whose runs, box and level are set. */
void spot_sum(struct spot *spot, const struct run *runs, const struct grey_image *image);

/* What the centroids of one image are sought in. */
struct spot_scene {
	const struct grey_image *image;
	const struct level_map *map;
	const struct blob_settings *settings; /* in the pixel's own values */
	const struct run *runs;
	struct feed *feed;
};

/* Pixels [x0, x1) by [y0, y1), all inside the image; x1 - x0 is a multiple of WINDOW_STEP_PX.
 */
#define WINDOW_STEP_PX 8
struct window {
	int x0, x1, y0, y1;
};

/* The centroid is the zero of sum(d w(u) S), where d = (x, y) - centre, S = I - background and
 * u = d' q d is the squared distance, 1 where the window ends. With w Gaussian this is SExtractor's
 * windowed position (Bertin & Arnouts); the others give the edge of a flat disc, where its position
 * is written, the weight it deserves. All end smoothly: the factor e is (1 - u2)^2. */
enum kernel_profile {
	PROFILE_HILL,      /* w = e */
	PROFILE_MESA,      /* w = (1 + 4 u) e */
	PROFILE_RING,      /* w = u e */
	PROFILE_THIN_RING, /* w = u2 e */
};

struct kernel {
	float qxx, qxy, qyy;
	enum kernel_profile profile;
	float noise_variance; /* of a dark pixel, grey values squared */
	float electrons_per_grey;
};

/* A centroid on its way. */
struct fit {
	float clear_px; /* around the spot's middle, a radius that no other spot reaches */
	uint32_t spot;
	const struct patch_copy *copy; /* of its surroundings, while that says so itself */
	bool windowed;                 /* the kernel is of use */
	float surround; /* grey value that a spot must stand out of, on its brightest side */
	float contrast; /* of opposite sides, grey values, where the map was too coarse */
	float tilt_px;  /* what a rim or a merged neighbour may pull the centroid by */
	float floor_px; /* of its sigma, whatever the noise */
	float x_px, y_px, variance;
	float shape_px2[3];      /* second central moments, xx xy yy */
	float dx, dy;            /* the last step */
	struct plane background; /* around (x, y) */
	struct kernel kernel;
	struct window window;
};

/* The window of at least these half widths around (x, y). Returns false when it reaches beyond the
 * image. */
bool window_around(const struct grey_image *image, float x_px, float y_px, float half_x_px,
		   float half_y_px, struct window *out);

/* One Newton step: moves (x, y), sets the step and the variance. Returns false, and leaves all as
 * it was, when the window holds nothing that has a centroid. */
bool window_newton(const struct grey_image *image, struct fit *fit, struct feed *feed);

/* The background from the four sides of a ring around the spot, as a plane around its middle, and
 * the brightest side, and the contrast between opposite sides. Returns false where the image ends.
 */
bool ring_background(const struct grey_image *image, const struct spot *spot, struct plane *out,
		     float *brightest, float *contrast);

/* The plain moment as a first place. */
void spot_moment(const struct spot *spot, struct fit *fit);

/* The steps to a blob; up to FIT_LANES are prepared side by side, the first three of each fit
 * being set. spot_finish returns false when the spot is a hot pixel, a lamp or noise; else it sets
 * all of `out`. */
#define FIT_LANES 8
void spot_prepare(const struct spot_scene *scene, const struct spot *spots, struct fit fits[],
		  uint32_t count);
void spot_step(const struct spot_scene *scene, struct fit *fit);
bool spot_finish(const struct spot *spot, const struct spot_scene *scene, struct fit *fit,
		 struct blob *out);

/* Whether a summed spot may be several, or the edge of a glow. */
bool spot_is_suspect(const struct spot *spot);

/* Whether no level of those that would be tried parts it, as a look at the pixels in the spot's
 * box tells; false: it must be tried. */
bool spot_is_surely_one(const struct spot *spot, const struct grey_image *image);

/* Replaces spot s by what stands out of it, appended to the table and summed; or throws it away
 * when it is large and dim and nothing does. Leaves it when it is one spot after all. Returns
 * whether the spot is still there. */
bool spot_split(struct run_table *table, uint32_t s, const struct spot_scene *scene);

/* Measures spots one after another, so that the work can be done between the rows of the scan: many
 * at once, for each time the scan stops the processor forgets that it is to read ahead. */
#define FITS_WAITING (4 * FIT_LANES)
struct measurer {
	struct spot_scene scene;
	struct run_table *table;
	struct blob_set *set;
	uint32_t next;  /* spot to look at */
	uint32_t first; /* of the spots that were found last: it may have neighbours from here on */
	int wait_row;   /* nothing to do before this one is read */
	uint32_t fit_count; /* spots that wait for others to be measured with */
	struct fit fits[FITS_WAITING];
	uint32_t suspect_count;
	uint32_t suspects[SPOT_MAX];
	int top_px[BLOB_MAX], left_px[BLOB_MAX]; /* of each blob, to sort by */
};

void measurer_start(struct measurer *measurer, const struct spot_scene *scene,
		    struct run_table *table, struct blob_set *set);

/* Looks at one spot. The image has been read down to row `row_read`, and the runs joined down to
 * MEASURE_LAG_ROWS above it. Returns false when there is nothing to do yet. */
bool measurer_step(struct measurer *measurer, int row_read);

/* Measures what is left, suspects last, and sorts the blobs. */
void measurer_end(struct measurer *measurer);

typedef void blob_run_fn(struct blob_finder *finder, const struct grey_image *image,
			 struct blob_set *set);
blob_run_fn blob_run;

#define CLAIM_COUNT 3

/* Pixels of a group that belong to a spot already found, down to a row. */
struct claim {
	uint64_t mask;
	int last_y;
};

/* What the rows so far have said about a column of groups. */
struct group_state {
	struct claim claims[CLAIM_COUNT];
	int cells_y;              /* cell row that the levels are of */
	int long_way_y;           /* last row in which the group had runs */
	int quiet_y;              /* down to here it is known to hold nothing new */
	uint16_t cells[GROUP_PX]; /* room for the level of each pixel: group_cells() */
};

static inline grey *group_cells(struct group_state *state)
{
	return (grey *)(void *)state->cells;
}

/* The finder for pixels of 8 bits and of 16. */
struct blob_builds {
	blob_run_fn *grey8, *grey16;
};

struct blob_finder {
	struct blob_settings settings;
	int width_px, height_px, group_count;
	struct blob_builds builds;
	struct level_map map;
	void *coarse;               /* greys: levels of the current rows, per group */
	struct group_state *groups; /* [group_count] */
	size_t candidate_count, candidates_done;
	struct candidate *candidates; /* room for every group of the image */
	struct feed feed;
	struct run_table table;
	struct measurer measurer;
};

/* Wide and narrow builds give the same bits; the best on this processor, and the narrow ones. */
struct blob_builds blob_builds_best(void);
struct blob_builds blob_builds_any(void);

/* For tests. */
void blob_finder_use(struct blob_finder *finder, struct blob_builds builds);
