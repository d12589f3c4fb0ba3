/*
 * Background, noise and threshold, measured from the image itself: medians of a sparse sample
 * around nodes 64 px apart, and the noise from differences of near pixels, so that neither spots
 * nor gradients count as noise.
 */
#include <errno.h>
#include <math.h>
#include <simde/x86/sse2.h>
#include <stdlib.h>
#include <string.h>

#include "track/blobs_parts.h"

#define SAMPLE_BYTES 18     /* 16 pixels and, for the differences, 2 more */
#define DIFFERENCE_COUNT 32 /* per node */
#define BACKGROUND_SPAN 80  /* a node further above the median than this lies on a lamp */

typedef simde__m128i bytes16;

static bytes16 load(const uint8_t *p)
{
	return simde_mm_loadu_si128((const bytes16 *)p);
}

int level_map_init(struct level_map *map, int width_px, int height_px)
{
	size_t count;

	memset(map, 0, sizeof(*map));
	map->x_count = (width_px + GROUP_PX - 1) / GROUP_PX + 1;
	map->y_count = (height_px + GROUP_PX - 1) / GROUP_PX + 1;
	count = (size_t)map->x_count * (size_t)map->y_count;
	map->background = calloc(count, sizeof(*map->background));
	map->limit = calloc(count, CELL_PX);
	map->noise = calloc(count, sizeof(*map->noise));
	if (map->background && map->limit && map->noise)
		return 0;
	level_map_finish(map);
	return -ENOMEM;
}

void level_map_finish(struct level_map *map)
{
	free(map->background);
	free(map->limit);
	free(map->noise);
	memset(map, 0, sizeof(*map));
}

static int clamp_int(int v, int low, int high)
{
	return v < low ? low : v > high ? high : v;
}

/* SAMPLE_BYTES pixels near (x, y) inside the image; `spare` serves images too narrow for that. */
static const uint8_t *sample(const struct grey_image *image, int x, int y, uint8_t *spare)
{
	const uint8_t *row;

	y = y < 0 ? -y : y >= image->height_px ? 2 * (image->height_px - 1) - y : y;
	y = clamp_int(y, 0, image->height_px - 1);
	row = image->pixels + (ptrdiff_t)y * image->stride_bytes;
	if (image->width_px >= SAMPLE_BYTES)
		return row + clamp_int(x, 0, image->width_px - SAMPLE_BYTES);
	for (int i = 0; i < SAMPLE_BYTES; i++)
		spare[i] = row[i % image->width_px];
	return spare;
}

static void order(bytes16 *a, bytes16 *b)
{
	bytes16 low = simde_mm_min_epu8(*a, *b);

	*b = simde_mm_max_epu8(*a, *b);
	*a = low;
}

/* Mean of the 16 lanes' medians of 8, in grey values. Lanes are spread over the sampled area: an
 * outlier area must cover a third of it to be felt. Batcher's merge sort, least and greatest
 * values left out where they no longer matter. */
static float median_level(bytes16 v[8])
{
	static const uint8_t net[][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
					 {4, 6}, {5, 7}, {1, 2}, {5, 6}, {0, 4}, {1, 5},
					 {2, 6}, {3, 7}, {2, 4}, {3, 5}, {3, 4}};
	bytes16 sum;

#pragma GCC unroll 17
	for (size_t i = 0; i < sizeof(net) / sizeof(net[0]); i++)
		order(&v[net[i][0]], &v[net[i][1]]);
	sum = simde_mm_add_epi64(simde_mm_sad_epu8(v[3], simde_mm_setzero_si128()),
				 simde_mm_sad_epu8(v[4], simde_mm_setzero_si128()));
	return (float)(simde_mm_cvtsi128_si32(sum) +
		       simde_mm_cvtsi128_si32(simde_mm_srli_si128(sum, 8))) /
	       32.0f;
}

static void measure_node(struct level_map *map, const struct grey_image *image, int i, int j)
{
	size_t node = (size_t)j * (size_t)map->x_count + (size_t)i;
	bytes16 v[8], difference = simde_mm_setzero_si128();
	uint8_t spare[SAMPLE_BYTES];

	for (int k = 0; k < 8; k++) {
		int y = GROUP_PX * j + CELL_PX * (k / 2 - 1);
		int x = GROUP_PX * i - 24 + 32 * (k % 2) + CELL_PX * (k / 2 % 2);
		const uint8_t *p = sample(image, x, y, spare);

		v[k] = load(p);
		if (k == 1 || k == 6)
			difference = simde_mm_add_epi64(difference,
							simde_mm_sad_epu8(v[k], load(p + 2)));
	}
	map->background[node] = median_level(v);
	map->noise[node] = (uint16_t)(simde_mm_cvtsi128_si32(difference) +
				      simde_mm_cvtsi128_si32(simde_mm_srli_si128(difference, 8)));
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

static void measure_all(struct level_map *map)
{
	uint16_t levels[256] = {0}, noises[512] = {0};
	int count = map->x_count * map->y_count;

	for (int i = 0; i < count; i++) {
		levels[(int)(map->background[i] + 0.5f)]++;
		noises[map->noise[i] < 511 ? map->noise[i] : 511]++;
	}
	map->background_median = histogram_median(levels, 256, count);
	map->noise_sigma = uncut_noise(histogram_median(noises, 512, count) / DIFFERENCE_COUNT,
				       map->background_median);
}

/* Threshold above the background, for a background of so many grey values above the median. */
static void margins(const struct level_map *map, const struct blob_settings *settings,
		    float margin[BACKGROUND_SPAN + 1])
{
	for (int i = 0; i <= BACKGROUND_SPAN; i++) {
		double variance = (double)map->noise_sigma * (double)map->noise_sigma +
				  i / settings->electrons_per_grey;

		margin[i] = (float)fmax(settings->threshold_sigma * sqrt(variance),
					settings->threshold_min);
	}
}

void level_map_measure(struct level_map *map, const struct grey_image *image,
		       const struct blob_settings *settings)
{
	float margin[BACKGROUND_SPAN + 1];

	for (int j = 0; j < map->y_count; j++)
		for (int i = 0; i < map->x_count; i++)
			measure_node(map, image, i, j);
	measure_all(map);
	margins(map, settings, margin);
	for (int i = 0; i < map->x_count * map->y_count; i++) {
		float above = map->background[i] - map->background_median;

		if (above > BACKGROUND_SPAN)
			map->background[i] = map->background_median + BACKGROUND_SPAN;
		above = fminf(fmaxf(above, 0), BACKGROUND_SPAN);
		memset(map->limit + (size_t)i * CELL_PX,
		       (int)fminf(map->background[i] + margin[(int)above], 255), CELL_PX);
	}
}

/* `quarter` of the way from a to b. */
static bytes16 blend(bytes16 a, bytes16 b, int quarter)
{
	bytes16 middle = simde_mm_avg_epu8(a, b);

	switch (quarter) {
	case 0:
		return a;
	case 1:
		return simde_mm_avg_epu8(a, middle);
	case 2:
		return middle;
	default:
		return simde_mm_avg_epu8(middle, b);
	}
}

void level_map_row(const struct level_map *map, int cell_y, uint8_t *cells, uint8_t *groups)
{
	size_t pitch = (size_t)map->x_count * CELL_PX;
	const uint8_t *top = map->limit + (size_t)(cell_y / CELLS_PER_GROUP) * pitch;
	int quarter = cell_y % CELLS_PER_GROUP;
	bytes16 left = blend(load(top), load(top + pitch), quarter);

	for (int g = 0; g + 1 < map->x_count; g++) {
		const uint8_t *node = top + (size_t)(g + 1) * CELL_PX;
		bytes16 right = blend(load(node), load(node + pitch), quarter), lowest = left;

		for (int c = 0; c < CELLS_PER_GROUP; c++) {
			bytes16 level = blend(left, right, c);

			lowest = simde_mm_min_epu8(lowest, level);
			simde_mm_storeu_si128((bytes16 *)cells, level);
			cells += CELL_PX;
		}
		simde_mm_storeu_si128((bytes16 *)groups, lowest);
		groups += CELL_PX;
		left = right;
	}
}

struct plane level_map_plane(const struct level_map *map, float x_px, float y_px)
{
	float u = (x_px - 7.5f) / GROUP_PX, v = (y_px - 7.5f) / GROUP_PX;
	int i = clamp_int((int)floorf(u), 0, map->x_count - 2);
	int j = clamp_int((int)floorf(v), 0, map->y_count - 2);
	const float *top = map->background + (size_t)j * (size_t)map->x_count + (size_t)i;
	const float *low = top + map->x_count;
	float dx = (top[1] - top[0] + low[1] - low[0]) / 2;
	float dy = (low[0] - top[0] + low[1] - top[1]) / 2;

	u -= (float)i + 0.5f;
	v -= (float)j + 0.5f;
	return (struct plane){(top[0] + top[1] + low[0] + low[1]) / 4 + u * dx + v * dy,
			      dx / GROUP_PX, dy / GROUP_PX,
			      fabsf(top[0] - top[1] - low[0] + low[1])};
}
