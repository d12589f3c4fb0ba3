/*
 * Background, noise and threshold, measured from the image itself: medians of sparse samples, and
 * the noise from differences of near pixels, so that neither spots nor gradients count as noise.
 */
#include <limits.h>
#include <math.h>

#include "track/blobs/blobs_parts.h"

#define COARSE_MARGIN 0.75f /* of the margin: nothing is lost where the survey was high */
#define FLAT 1.6f           /* 256ths: less is noise and rounding */
#define SLOPE_DEADBAND 0.5f /* 256ths: a node's own noise is no slope */
#define FIRST_ROWS 6        /* that come to the scan while the survey waits */
#define BENT 2              /* 256ths: a column of nodes that bends more lies on something */

static int smaller(int a, int b)
{
	return a < b ? a : b;
}

static int clamp_int(int v, int low, int high)
{
	return v < low ? low : v > high ? high : v;
}

static void fill(grey cell[CELL_PX], int value)
{
	for (int i = 0; i < CELL_PX; i++)
		cell[i] = (grey)value;
}

/* Middle value, interpolated within its bin of 2^shift values. */
static float histogram_median(const uint16_t *bins, int bin_count, int shift, int total)
{
	int below = 0;

	for (int b = 0; b < bin_count; b++) {
		if (2 * (below + bins[b]) >= total)
			return ((float)b + ((float)total / 2 - (float)below) / (float)bins[b]) *
				       (float)(1 << shift) -
			       0.5f;
		below += bins[b];
	}
	return (float)((bin_count - 1) << shift);
}

/* Where the black level cuts the noise off, differences are smaller than the noise. */
static float uncut_noise(float mean_difference, float background)
{
	float sigma = mean_difference / 1.128f;

	for (int i = 0; i < 3; i++) {
		float cut = 0.5f * (1 + erff(background / (0.9f * 1.4142f * fmaxf(sigma, 0.1f))));

		sigma = mean_difference / (1.128f * cut);
	}
	return fmaxf(sigma, 0.3f);
}

/* Cell row of the survey's row r. */
static int survey_row(const struct level_map *map, int r)
{
	return map->survey_y[r] / CELL_PX;
}

static void prefetch_row(const struct grey_image *image, const grey *row)
{
	for (int x = 0; x < image->width_px; x += LINE_BYTES / (int)sizeof(*row))
		__builtin_prefetch(row + x);
}

/* Asks for the survey's pixels before they are needed, and then for those that the scan begins
 * with. */
static void prefetch_survey(const struct level_map *map, const struct grey_image *image)
{
	for (int r = 0; r < SURVEY_ROWS; r++)
		prefetch_row(image, sampled_row(image, survey_row(map, r)));
	for (int y = 0; y < FIRST_ROWS && y < image->height_px; y++)
		prefetch_row(image, grey_row(image, y));
}

static void survey(struct level_map *map, const struct grey_image *image)
{
	const int shift = grey_bin_shift(image), noise_shift = noise_bin_shift(image);
	uint16_t levels[GREY_BINS] = {0}, noises[NOISE_BINS] = {0}, *level = map->survey;
	int count = SURVEY_ROWS * map->x_count;
	float noise;

	for (int r = 0; r < SURVEY_ROWS; r++)
		for (int i = 0; i < map->x_count; i++, level++) {
			int row = survey_row(map, r);
			int differences = sample_noise(image, i, row) >> noise_shift;

			noises[smaller(differences, NOISE_BINS - 1)]++;
			*level = (uint16_t)smaller((int)(sample_level(image, i, row) + 0.5f),
						   grey_white(image));
			levels[*level >> shift]++;
		}
	map->background_median = histogram_median(levels, GREY_BINS, shift, count);
	noise = histogram_median(noises, NOISE_BINS, noise_shift, count);
	if (noise > (float)((NOISE_BINS - 2) << noise_shift))
		noise = (float)(grey_white(image) * DIFFERENCE_COUNT); /* no picture at all:
						nothing shall stand out of it */
	map->noise_sigma = uncut_noise(noise / DIFFERENCE_COUNT, map->background_median);
}

void level_map_start(struct level_map *map, const struct grey_image *image,
		     const struct blob_settings *settings)
{
	map->image = image;
	map->epoch++;
	prefetch_survey(map, image);
	survey(map, image);
	for (int i = 0; i <= BACKGROUND_SPAN; i++) {
		float light = (float)i * grey_unit(image);
		float variance = map->noise_sigma * map->noise_sigma +
				 light / (float)settings->electrons_per_grey;
		float margin = (float)settings->threshold_sigma * sqrtf(variance);

		map->margin[i] = margin > (float)settings->threshold_min
					 ? margin
					 : (float)settings->threshold_min;
	}
}

int level_map_coarse(const struct level_map *map, int y, grey *groups)
{
	const int most = (int)(map->background_median + BACKGROUND_SPAN * grey_unit(map->image));
	int below = 0, above, end;

	while (below < SURVEY_ROWS && map->survey_y[below] <= y)
		below++;
	end = below < SURVEY_ROWS ? map->survey_y[below] : INT_MAX;
	above = below > 0 ? below - 1 : 0;
	below = below < SURVEY_ROWS ? below : SURVEY_ROWS - 1;
	for (int g = 0; g + 1 < map->x_count; g++) {
		const uint16_t *a = map->survey + above * map->x_count + g;
		const uint16_t *b = map->survey + below * map->x_count + g;
		int lowest = smaller(smaller(a[0], a[1]), smaller(b[0], b[1]));
		int level = smaller(lowest, most) + (int)(COARSE_MARGIN * map->margin[0]);

		fill(groups + (size_t)g * CELL_PX, smaller(level, grey_white(map->image)));
	}
	return end;
}

void level_map_expect(const struct level_map *map, int cell_y)
{
	const char *row = (const char *)&map->nodes[cell_y * map->x_count];

	for (size_t b = 0; b < (size_t)map->x_count * sizeof(*map->nodes); b += LINE_BYTES)
		__builtin_prefetch(row + b, 1);
}

static void set_node(const struct level_map *map, struct level_node *node, float level)
{
	const float unit = grey_unit(map->image), median = map->background_median;
	const float most = median + BACKGROUND_SPAN * unit;
	float over;

	level = level < most ? level : most;
	over = level > median ? level - median : 0;
	node->background = level;
	node->limit = (uint16_t)smaller((int)(level + map->margin[(int)(over / unit)]),
					grey_white(map->image));
	node->epoch = map->epoch;
}

/* Node (i, j), measured if this image has not asked for it yet. */
static const struct level_node *node_at(const struct level_map *map, int i, int j)
{
	struct level_node *node = &map->nodes[j * map->x_count + i];

	if (node->epoch != map->epoch)
		set_node(map, node, sample_level(map->image, i, j));
	return node;
}

/* Node (i, j) and the next. */
static const struct level_node *nodes_at(const struct level_map *map, int i, int j)
{
	struct level_node *node = &map->nodes[j * map->x_count + i];
	float levels[2];

	if (node[0].epoch != map->epoch || node[1].epoch != map->epoch) {
		sample_two_levels(map->image, i, j, levels);
		set_node(map, node, levels[0]);
		set_node(map, node + 1, levels[1]);
	}
	return node;
}

void level_map_cells(const struct level_map *map, int cell_y, int group, grey cells[GROUP_PX])
{
	const struct level_node *nodes = nodes_at(map, group, cell_y);
	int left = nodes[0].limit, right = nodes[1].limit, middle = (left + right + 1) / 2;

	grey_fill_cells(cells, left, (left + middle + 1) / 2);
	grey_fill_cells(cells + 2 * CELL_PX, middle, (middle + right + 1) / 2);
}

static float without_noise(float difference, float unit)
{
	const float dead = SLOPE_DEADBAND * unit;

	if (difference > dead)
		return difference - dead;
	return difference < -dead ? difference + dead : 0;
}

/* A column of three nodes: their median, and half of what it rises from the first to the last. A
 * node that lies on bright things bends the column rather than tilts it; then nothing is said. */
static float column(const struct level_map *map, int i, const int rows[3], float *rise)
{
	float a = node_at(map, i, rows[0])->background, b = node_at(map, i, rows[1])->background;
	float c = node_at(map, i, rows[2])->background;
	float low = a < b ? a : b, high = a < b ? b : a, unit = grey_unit(map->image);

	*rise = fabsf(a - 2 * b + c) > fabsf(c - a) + BENT * unit ? 0
								  : without_noise(c - a, unit) / 2;
	return c < low ? low : c > high ? high : c;
}

/* Whether the survey sees the same level above, below, left and right of column i, and a node
 * measured since agrees: then there is no slope worth three rows of nodes. */
static bool is_flat(const struct level_map *map, int i, int y, float level)
{
	int below = 0, above;
	const uint16_t *a, *b;
	const float flat = FLAT * grey_unit(map->image), low = level - flat, high = level + flat;

	while (below < SURVEY_ROWS - 1 && map->survey_y[below] <= y)
		below++;
	above = below > 0 ? below - 1 : 0;
	a = map->survey + above * map->x_count + i;
	b = map->survey + below * map->x_count + i;
	return a[0] > low && a[0] < high && a[1] > low && a[1] < high && b[0] > low &&
	       b[0] < high && b[1] > low && b[1] < high;
}

struct plane level_map_plane(const struct level_map *map, float x_px, float y_px)
{
	int x = clamp_int((int)x_px - 7, 0, GROUP_PX * (map->x_count - 1) - 1);
	int y = clamp_int((int)y_px, 0, CELL_PX * map->y_count - 1);
	int i = x / GROUP_PX, j = y / CELL_PX;
	const int rows[3] = {j > 0 ? j - 1 : 0, j, smaller(j + 1, map->y_count - 1)};
	const struct level_node *nodes = nodes_at(map, i, j);
	float left = nodes[0].background, right = nodes[1].background;
	float u = (x_px - 7.5f) / GROUP_PX, v = (y_px - 7.5f) / CELL_PX, dx, dy;
	float left_rise, right_rise, unit = grey_unit(map->image);

	if (fabsf(right - left) < FLAT * unit && is_flat(map, i, y, (left + right) / 2))
		return (struct plane){(left + right) / 2, 0, 0};
	left = column(map, i, rows, &left_rise);
	right = column(map, i + 1, rows, &right_rise);
	dx = without_noise(right - left, unit);
	dy = (left_rise + right_rise) / (float)(rows[2] - rows[0] > 1 ? 2 : 1);
	return (struct plane){
		(left + right) / 2 + dx * (u - (float)i - 0.5f) + dy * (v - (float)j),
		dx / GROUP_PX,
		dy / CELL_PX,
	};
}
