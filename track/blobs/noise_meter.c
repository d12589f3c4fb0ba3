/*
 * A line through variance over light, weighted by how well each variance is known.
 */
#include "track/blobs/noise_meter.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#define PIXELS_MIN 40      /* of a grey value, in a pair of images that may tell */
#define CLIP_SIGMA 3.5     /* what is further out moved */
#define CLIP_SHARE 0.99389 /* of a Gaussian's variance that stays within */
#define CLIP_ROUNDS 6
#define MOVED_SHARE 0.1 /* beyond the clip: this light is not still */
#define BLACK_SIGMA 4   /* nearer to black or white the noise is cut off */
#define ROUNDING (1 / 12.0)

void noise_meter_reset(struct noise_meter *meter)
{
	memset(meter, 0, sizeof(*meter));
}

/* Sums over the differences within `reach` of `middle`. */
struct level_sums {
	double count, mean, variance, outside;
};

static struct level_sums sum_level(const uint32_t *counts, double middle, double reach)
{
	double n = 0, d1 = 0, d2 = 0, outside = 0;

	for (int i = 0; i <= 2 * NOISE_REACH; i++) {
		double d = i - NOISE_REACH, count = (double)counts[i];

		if (fabs(d - middle) > reach) {
			outside += count;
			continue;
		}
		n += count;
		d1 += count * d;
		d2 += count * d * d;
	}
	if (!(n > 1))
		return (struct level_sums){0, 0, 0, outside};
	return (struct level_sums){n, d1 / n, (d2 - d1 / n * d1) / (n - 1), outside};
}

/* One pair's part of what a grey value tells, motion clipped off. The pair's mean is taken off, so
 * that light which flickers from image to image does not count as noise. */
static void add_level(struct noise_level *level, const uint32_t *counts)
{
	struct level_sums sums = sum_level(counts, 0, NOISE_REACH);
	double sigma = sqrt(sums.variance);

	if (sums.count < PIXELS_MIN)
		return;
	for (int i = 0; i < CLIP_ROUNDS; i++) {
		sums = sum_level(counts, sums.mean, fmax(CLIP_SIGMA * sigma, 1.5));
		sigma = sqrt(sums.variance / CLIP_SHARE);
	}
	if (sums.count < PIXELS_MIN || sums.outside > MOVED_SHARE * sums.count)
		return;
	level->count += sums.count;
	level->squares += sums.count * sigma * sigma;
}

void noise_meter_add(struct noise_meter *meter, const uint8_t *a, const uint8_t *b, int width_px,
		     int height_px, int stride_a_bytes, int stride_b_bytes)
{
	memset(meter->pair, 0, sizeof(meter->pair));
	for (int y = 0; y < height_px; y++, a += stride_a_bytes, b += stride_b_bytes)
		for (int x = 0; x < width_px; x++) {
			int difference = a[x] - b[x], light = (a[x] + b[x]) / 2;

			meter->levels[light].pixel_count++;
			if (difference >= -NOISE_REACH && difference <= NOISE_REACH)
				meter->pair[light][NOISE_REACH + difference]++;
		}
	for (int g = 0; g < 256; g++)
		add_level(&meter->levels[g], meter->pair[g]);
}

static int median_grey(const struct noise_meter *meter)
{
	uint64_t total = 0, below = 0;
	int grey = 0;

	for (int g = 0; g < 256; g++)
		total += meter->levels[g].pixel_count;
	while (grey < 255 && 2 * (below += meter->levels[grey].pixel_count) < total)
		grey++;
	return grey;
}

/* Weighted sums of a straight line y over x. */
struct line {
	double w, x, y, xx, xy;
};

static void add_point(struct line *line, double x, double y, double weight)
{
	line->w += weight;
	line->x += weight * x;
	line->y += weight * y;
	line->xx += weight * x * x;
	line->xy += weight * x * y;
}

/* The mean of two integers, rounded down, is half a grey value low every other time. */
static double light_of_level(int level)
{
	return level + 0.25;
}

static struct line gather(const struct noise_meter *meter, struct noise_model *model, int *levels)
{
	struct line line = {0};
	*levels = 0;
	for (int g = 0; g < 256; g++) {
		const struct noise_level *level = &meter->levels[g];
		double count = level->count, variance = level->squares / (2 * count);

		if (!(variance > 0) || g < BLACK_SIGMA * sqrt(variance) ||
		    255 - g < BLACK_SIGMA * sqrt(variance))
			continue;
		/* The variance of a variance of n is 2 v2 / n. */
		add_point(&line, light_of_level(g), variance, count / (2 * variance * variance));
		model->lowest_grey = *levels ? model->lowest_grey : g;
		model->highest_grey = g;
		(*levels)++;
	}
	return line;
}

int noise_meter_solve(const struct noise_meter *meter, struct noise_model *out)
{
	struct noise_model model = {.dark_grey = median_grey(meter)};
	int levels;
	struct line line = gather(meter, &model, &levels);
	double det = line.w * line.xx - line.x * line.x, slope, sigma, dark;

	if (levels < NOISE_SPAN_GREY || !(det > 0))
		return -ENODATA;
	slope = (line.w * line.xy - line.x * line.y) / det;
	sigma = sqrt(line.w / det);
	dark = (line.y - slope * line.x) / line.w + slope * light_of_level(model.dark_grey);
	if (!(slope > 5 * sigma) || !(dark > 0))
		return -ERANGE;
	model.electrons_per_grey = 1 / slope;
	model.electrons_per_grey_sigma = sigma / (slope * slope);
	model.read_noise_grey = sqrt(fmax(dark - ROUNDING, 0));
	*out = model;
	return 0;
}
