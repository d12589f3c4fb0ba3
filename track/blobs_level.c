/*
 * Background, noise and threshold, measured from the image itself: medians of sparse samples, and
 * the noise from differences of near pixels, so that neither spots nor gradients count as noise.
 */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <simde/x86/avx2.h>
#include <stdlib.h>
#include <string.h>

#include "track/blobs_parts.h"

#define COARSE_MARGIN 0.75f /* of the margin: nothing is lost where the survey was high */
#define SAMPLE_BYTES 16
#define SAMPLE_COUNT 8      /* side by side, around a node */
#define DIFFERENCE_COUNT 28 /* per node of the survey */
#define NOISE_BINS 1024
#define FLAT 1.6f           /* grey values: less is noise and rounding */
#define SLOPE_DEADBAND 0.5f /* grey values: a node's own noise is no slope */

typedef simde__m128i bytes16;
typedef simde__m256i bytes32;

static bytes16 load(const uint8_t *p)
{
	return simde_mm_loadu_si128((const bytes16 *)p);
}

int level_map_init(struct level_map *map, int width_px, int height_px)
{
	size_t count;

	memset(map, 0, sizeof(*map));
	map->x_count = (width_px + GROUP_PX - 1) / GROUP_PX + 1;
	map->y_count = (height_px + CELL_PX - 1) / CELL_PX;
	for (int r = 0; r < SURVEY_ROWS; r++)
		map->survey_y[r] = (2 * r + 1) * map->y_count / (2 * SURVEY_ROWS) * CELL_PX;
	count = (size_t)map->x_count * (size_t)map->y_count;
	map->nodes = calloc(count, sizeof(*map->nodes));
	map->survey = calloc((size_t)map->x_count, SURVEY_ROWS);
	if (map->nodes && map->survey)
		return 0;
	level_map_finish(map);
	return -ENOMEM;
}

void level_map_finish(struct level_map *map)
{
	free(map->nodes);
	free(map->survey);
	memset(map, 0, sizeof(*map));
}

static int smaller(int a, int b)
{
	return a < b ? a : b;
}

static int clamp_int(int v, int low, int high)
{
	return v < low ? low : v > high ? high : v;
}

static const uint8_t *sampled_row(const struct grey_image *image, int j)
{
	int y = smaller(CELL_PX * j + CELL_PX / 2, image->height_px - 1);

	return image->pixels + (ptrdiff_t)y * image->stride_bytes;
}

/* Where the samples of a node begin: column i stands 8 px into group i, samples reach 64 px to both
 * sides. At the border they move inwards; in a narrow image they overlap. */
static int sample_x(const struct grey_image *image, int i, int k)
{
	int x = GROUP_PX * i + 8 - GROUP_PX + SAMPLE_BYTES * k;

	return clamp_int(x, 0, image->width_px - SAMPLE_BYTES);
}

static void load_samples(const struct grey_image *image, int i, int j, bytes16 v[SAMPLE_COUNT])
{
	const uint8_t *row = sampled_row(image, j);
	uint8_t narrow[SAMPLE_BYTES];

	if (i > 0 && GROUP_PX * (i + 1) + 8 <= image->width_px) {
		for (int k = 0; k < SAMPLE_COUNT; k++)
			v[k] = load(row + GROUP_PX * (i - 1) + 8 + SAMPLE_BYTES * k);
		return;
	}
	if (image->width_px < SAMPLE_BYTES) {
		for (int k = 0; k < SAMPLE_BYTES; k++)
			narrow[k] = row[k % image->width_px];
		for (int k = 0; k < SAMPLE_COUNT; k++)
			v[k] = load(narrow);
		return;
	}
	for (int k = 0; k < SAMPLE_COUNT; k++)
		v[k] = load(row + sample_x(image, i, k));
}

static void order(bytes16 *a, bytes16 *b)
{
	bytes16 low = simde_mm_min_epu8(*a, *b);

	*b = simde_mm_max_epu8(*a, *b);
	*a = low;
}

static int lane_sum(bytes16 sums)
{
	return simde_mm_cvtsi128_si32(sums) + simde_mm_cvtsi128_si32(simde_mm_srli_si128(sums, 8));
}

/* Batcher's merge sort of eight, less what does not reach the middle. */
static const uint8_t net[][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
				 {4, 6}, {5, 7}, {1, 2}, {5, 6}, {0, 4}, {1, 5},
				 {2, 6}, {3, 7}, {2, 4}, {3, 5}, {3, 4}};
#define NET_COUNT (sizeof(net) / sizeof(net[0]))

/* Mean of the 16 lanes' medians of 8, in grey values: an outlier area must cover a third of the
 * samples to be felt. */
static float median_level(bytes16 v[SAMPLE_COUNT])
{
	bytes16 sum;

#pragma GCC unroll 17
	for (size_t i = 0; i < NET_COUNT; i++)
		order(&v[net[i][0]], &v[net[i][1]]);
	sum = simde_mm_add_epi64(simde_mm_sad_epu8(v[3], simde_mm_setzero_si128()),
				 simde_mm_sad_epu8(v[4], simde_mm_setzero_si128()));
	return (float)lane_sum(sum) / 32.0f;
}

/* Sum of DIFFERENCE_COUNT differences of pixels two apart, where no lens blur ties them: 14 each of
 * two samples. */
static int node_noise(const bytes16 v[SAMPLE_COUNT])
{
	bytes16 mask = simde_mm_srli_si128(simde_mm_set1_epi8(-1), 2);
	bytes16 a = simde_mm_sad_epu8(simde_mm_and_si128(v[2], mask), simde_mm_srli_si128(v[2], 2));
	bytes16 b = simde_mm_sad_epu8(simde_mm_and_si128(v[6], mask), simde_mm_srli_si128(v[6], 2));

	return lane_sum(simde_mm_add_epi64(a, b));
}

/* Middle value, interpolated within its bin. */
static float histogram_median(const uint16_t *bins, int bin_count, int total)
{
	int below = 0;

	for (int b = 0; b < bin_count; b++) {
		if (2 * (below + bins[b]) >= total)
			return (float)b + ((float)total / 2 - (float)below) / (float)bins[b] - 0.5f;
		below += bins[b];
	}
	return (float)(bin_count - 1);
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

/* Asks for the survey's pixels before they are needed. */
static void prefetch_survey(const struct level_map *map, const struct grey_image *image)
{
	for (int r = 0; r < SURVEY_ROWS; r++) {
		const uint8_t *row = sampled_row(image, survey_row(map, r));

		for (int x = 0; x < image->width_px; x += GROUP_PX)
			__builtin_prefetch(row + x);
	}
}

static void survey(struct level_map *map, const struct grey_image *image)
{
	uint16_t levels[256] = {0}, noises[NOISE_BINS] = {0};
	uint8_t *level = map->survey;
	int count = SURVEY_ROWS * map->x_count;
	float noise;

	for (int r = 0; r < SURVEY_ROWS; r++)
		for (int i = 0; i < map->x_count; i++, level++) {
			bytes16 v[SAMPLE_COUNT];

			load_samples(image, i, survey_row(map, r), v);
			noises[smaller(node_noise(v), NOISE_BINS - 1)]++;
			*level = (uint8_t)(median_level(v) + 0.5f);
			levels[*level]++;
		}
	map->background_median = histogram_median(levels, 256, count);
	noise = histogram_median(noises, NOISE_BINS, count);
	if (noise > NOISE_BINS - 2) /* no picture at all: nothing shall stand out of it */
		noise = 255 * DIFFERENCE_COUNT;
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
		float variance = map->noise_sigma * map->noise_sigma +
				 (float)i / (float)settings->electrons_per_grey;
		float margin = (float)settings->threshold_sigma * sqrtf(variance);

		map->margin[i] = margin > (float)settings->threshold_min
					 ? margin
					 : (float)settings->threshold_min;
	}
}

int level_map_coarse(const struct level_map *map, int y, uint8_t *groups)
{
	int below = 0, above, end;

	while (below < SURVEY_ROWS && map->survey_y[below] <= y)
		below++;
	end = below < SURVEY_ROWS ? map->survey_y[below] : INT_MAX;
	above = below > 0 ? below - 1 : 0;
	below = below < SURVEY_ROWS ? below : SURVEY_ROWS - 1;
	for (int g = 0; g + 1 < map->x_count; g++) {
		const uint8_t *a = map->survey + above * map->x_count + g;
		const uint8_t *b = map->survey + below * map->x_count + g;
		int lowest = smaller(smaller(a[0], a[1]), smaller(b[0], b[1]));
		int level = smaller(lowest, (int)map->background_median + BACKGROUND_SPAN) +
			    (int)(COARSE_MARGIN * map->margin[0]);

		memset(groups + (size_t)g * CELL_PX, smaller(level, 255), CELL_PX);
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
	float median = map->background_median, most = median + BACKGROUND_SPAN, over;

	level = level < most ? level : most;
	over = level > median ? level - median : 0;
	node->background = level;
	node->limit = (uint8_t)smaller((int)(level + map->margin[(int)over]), 255);
	node->epoch = map->epoch;
}

static void measure_node(const struct level_map *map, struct level_node *node, int i, int j)
{
	bytes16 v[SAMPLE_COUNT];

	load_samples(map->image, i, j, v);
	set_node(map, node, median_level(v));
}

/* Nodes (i, j) and (i + 1, j) at once, away from the border: a half of each vector is one's, and
 * the samples of the second begin where those of the first are half over. */
static void measure_two(const struct level_map *map, int i, int j)
{
	const uint8_t *p = sampled_row(map->image, j) + GROUP_PX * (i - 1) + 8;
	struct level_node *node = &map->nodes[j * map->x_count + i];
	bytes32 v[SAMPLE_COUNT], sum, zero = simde_mm256_setzero_si256();

	for (int k = 0; k < SAMPLE_COUNT; k++)
		v[k] = simde_mm256_set_m128i(load(p + GROUP_PX + SAMPLE_BYTES * k),
					     load(p + SAMPLE_BYTES * k));
#pragma GCC unroll 17
	for (size_t s = 0; s < NET_COUNT; s++) {
		bytes32 a = v[net[s][0]], b = v[net[s][1]];

		v[net[s][0]] = simde_mm256_min_epu8(a, b);
		v[net[s][1]] = simde_mm256_max_epu8(a, b);
	}
	sum = simde_mm256_add_epi64(simde_mm256_sad_epu8(v[3], zero),
				    simde_mm256_sad_epu8(v[4], zero));
	set_node(map, node, (float)lane_sum(simde_mm256_castsi256_si128(sum)) / 32.0f);
	set_node(map, node + 1, (float)lane_sum(simde_mm256_extracti128_si256(sum, 1)) / 32.0f);
}

/* Node (i, j), measured if this image has not asked for it yet. */
static const struct level_node *node_at(const struct level_map *map, int i, int j)
{
	struct level_node *node = &map->nodes[j * map->x_count + i];

	if (node->epoch != map->epoch)
		measure_node(map, node, i, j);
	return node;
}

/* Node (i, j) and the next. */
static const struct level_node *nodes_at(const struct level_map *map, int i, int j)
{
	const struct level_node *node = &map->nodes[j * map->x_count + i];

	if (node[0].epoch == map->epoch && node[1].epoch == map->epoch)
		return node;
	if (i > 0 && GROUP_PX * (i + 2) + 8 <= map->image->width_px) {
		measure_two(map, i, j);
	} else {
		node_at(map, i, j);
		node_at(map, i + 1, j);
	}
	return node;
}

void level_map_cells(const struct level_map *map, int cell_y, int group, uint8_t cells[GROUP_PX])
{
	const struct level_node *nodes = nodes_at(map, group, cell_y);
	bytes16 left = simde_mm_set1_epi8((char)nodes[0].limit);
	bytes16 right = simde_mm_set1_epi8((char)nodes[1].limit);
	bytes16 middle = simde_mm_avg_epu8(left, right);

	simde_mm_storeu_si128((bytes16 *)cells, left);
	simde_mm_storeu_si128((bytes16 *)(cells + CELL_PX), simde_mm_avg_epu8(left, middle));
	simde_mm_storeu_si128((bytes16 *)(cells + 2 * CELL_PX), middle);
	simde_mm_storeu_si128((bytes16 *)(cells + 3 * CELL_PX), simde_mm_avg_epu8(middle, right));
}

static float without_noise(float difference)
{
	if (difference > SLOPE_DEADBAND)
		return difference - SLOPE_DEADBAND;
	return difference < -SLOPE_DEADBAND ? difference + SLOPE_DEADBAND : 0;
}

/* A column of three nodes: their median, and half of what it rises from the first to the last. A
 * node that lies on bright things bends the column rather than tilts it; then nothing is said. */
static float column(const struct level_map *map, int i, const int rows[3], float *rise)
{
	float a = node_at(map, i, rows[0])->background, b = node_at(map, i, rows[1])->background;
	float c = node_at(map, i, rows[2])->background;
	float low = a < b ? a : b, high = a < b ? b : a;

	*rise = fabsf(a - 2 * b + c) > fabsf(c - a) + 2 ? 0 : without_noise(c - a) / 2;
	return c < low ? low : c > high ? high : c;
}

/* Whether the survey sees the same level above, below, left and right of column i, and a node
 * measured since agrees: then there is no slope worth three rows of nodes. */
static bool is_flat(const struct level_map *map, int i, int y, float level)
{
	int below = 0, above;
	const uint8_t *a, *b;
	float low = level - FLAT, high = level + FLAT;

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
	float left_rise, right_rise;

	if (fabsf(right - left) < FLAT && is_flat(map, i, y, (left + right) / 2))
		return (struct plane){(left + right) / 2, 0, 0};
	left = column(map, i, rows, &left_rise);
	right = column(map, i + 1, rows, &right_rise);
	dx = without_noise(right - left);
	dy = (left_rise + right_rise) / (float)(rows[2] - rows[0] > 1 ? 2 : 1);
	return (struct plane){
		(left + right) / 2 + dx * (u - (float)i - 0.5f) + dy * (v - (float)j),
		dx / GROUP_PX,
		dy / CELL_PX,
	};
}
