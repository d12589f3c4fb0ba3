/*
 * Centroids against the truth and the bound: pictures full of spots, at random places and of random
 * sizes and brightness, in two models of a spot.
 */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/blobs.h"
#include "tests/bench/spot_model.h"
#include "track/blobs/blobs.h"

#define WIDTH 640
#define HEIGHT 512
#define PITCH_PX 44 /* the windows of neighbours do not touch */
#define SPOT_LIMIT 200
#define NEAR_PX 1.5
#define PICTURES 6 /* per model, times the effort */
#define PHASES 4
#define EXPOSURES 16

struct spot_place {
	double x_px, y_px, bound_px;
};

struct scene {
	float light[HEIGHT][WIDTH];
	uint8_t pixels[HEIGHT][WIDTH];
	int spot_count;
	struct spot_place spots[SPOT_LIMIT];
	struct blob_set set;
	struct blob_finder *finder;
};

/* Squares, of x and y together. */
struct score {
	double error_px2, bound_px2, in_bounds, in_sigmas;
	int count, missed, flagged;
};

static void scene_clear(struct scene *scene)
{
	scene->spot_count = 0;
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++)
			scene->light[y][x] = BENCH_BACKGROUND;
}

static void scene_add(struct scene *scene, const struct spot_model *model, double x_px, double y_px)
{
	static struct spot_stamp stamp;
	int x0 = (int)round(x_px), y0 = (int)round(y_px);

	spot_stamp_draw(&stamp, model, x_px - x0, y_px - y0);
	for (int j = 0; j < STAMP_PX; j++)
		for (int i = 0; i < STAMP_PX; i++) {
			int x = x0 + i - STAMP_HALF_PX, y = y0 + j - STAMP_HALF_PX;

			if (x >= 0 && x < WIDTH && y >= 0 && y < HEIGHT)
				scene->light[y][x] += stamp.light[j][i];
		}
	scene->spots[scene->spot_count++] =
		(struct spot_place){x_px, y_px, spot_stamp_bound(&stamp)};
}

static void scene_find(struct scene *scene, struct rng *rng)
{
	struct grey_image image = {scene->pixels[0], WIDTH, HEIGHT, WIDTH, 8};

	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++)
			scene->pixels[y][x] = exposed_pixel((double)scene->light[y][x], rng);
	blob_finder_run(scene->finder, &image, &scene->set);
}

static const struct blob *nearest(const struct blob_set *set, const struct spot_place *spot)
{
	const struct blob *best = NULL;
	double least_px = NEAR_PX;

	for (uint32_t b = 0; b < set->blob_count; b++) {
		double d_px = hypot((double)set->blobs[b].x_px - spot->x_px,
				    (double)set->blobs[b].y_px - spot->y_px);

		if (d_px < least_px) {
			least_px = d_px;
			best = &set->blobs[b];
		}
	}
	return best;
}

static void score_spot(struct score *score, const struct blob *blob, const struct spot_place *spot)
{
	double dx = 1, dy = 1, error_px2; /* missed: 1 px in x and y */
	double bound_px2 = spot->bound_px * spot->bound_px;

	score->count++;
	score->missed += !blob;
	if (blob) {
		dx = (double)blob->x_px - spot->x_px;
		dy = (double)blob->y_px - spot->y_px;
		score->in_sigmas += (dx * dx + dy * dy) / 2 / pow((double)blob->sigma_px, 2);
		score->flagged += blob->flags != 0;
	}
	error_px2 = (dx * dx + dy * dy) / 2;
	score->error_px2 += error_px2;
	score->bound_px2 += bound_px2;
	score->in_bounds += error_px2 / bound_px2;
}

static double between(struct rng *rng, double low, double high)
{
	return low + (high - low) * rng_uniform(rng);
}

static void score_pictures(const struct blobs_bench *bench, struct scene *scene,
			   enum point_spread spread, double dimmest, double brightest,
			   struct score *score)
{
	struct rng rng;

	memset(score, 0, sizeof(*score));
	rng_init(&rng, bench->seed, 10 + spread);
	for (int p = 0; p < PICTURES * bench->effort; p++) {
		scene_clear(scene);
		for (int y = 34; y < HEIGHT - 30; y += PITCH_PX) {
			struct spot_model model = {spread, between(&rng, 2, 8),
						   between(&rng, 0.6, 1.2), 0};

			for (int x = 34; x < WIDTH - 30; x += PITCH_PX) {
				model.amplitude = between(&rng, dimmest, brightest);
				scene_add(scene, &model, x + between(&rng, -3, 3),
					  y + between(&rng, -3, 3));
			}
		}
		scene_find(scene, &rng);
		for (int i = 0; i < scene->spot_count; i++)
			score_spot(score, nearest(&scene->set, &scene->spots[i]), &scene->spots[i]);
	}
}

/* Mean error over many exposures of spots that all lie alike on the pixels. */
static double phase_bias(const struct blobs_bench *bench, struct scene *scene,
			 const struct spot_model *model, double x_phase, double y_phase)
{
	double sum_x = 0, sum_y = 0;
	struct rng rng;
	int count = 0;

	rng_init(&rng, bench->seed, 20);
	scene_clear(scene);
	for (int y = 34; y < HEIGHT - 30; y += PITCH_PX)
		for (int x = 34; x < WIDTH - 30; x += PITCH_PX)
			scene_add(scene, model, x + x_phase, y + y_phase);
	for (int e = 0; e < EXPOSURES * bench->effort; e++) {
		scene_find(scene, &rng);
		for (int i = 0; i < scene->spot_count; i++) {
			const struct blob *blob = nearest(&scene->set, &scene->spots[i]);

			if (!blob)
				continue;
			sum_x += (double)blob->x_px - scene->spots[i].x_px;
			sum_y += (double)blob->y_px - scene->spots[i].y_px;
			count++;
		}
	}
	return count ? fmax(fabs(sum_x), fabs(sum_y)) / count : 1;
}

/* The worst of small and large, sharp and soft spots, over the phases of the pixel grid. */
static double worst_phase_bias(const struct blobs_bench *bench, struct scene *scene,
			       enum point_spread spread)
{
	static const double sizes[][2] = {{2, 0.6}, {3, 0.8}, {5, 0.6}, {8, 1}};
	double worst = 0;

	for (size_t s = 0; s < sizeof(sizes) / sizeof(sizes[0]); s++)
		for (int p = 0; p < PHASES; p++) {
			struct spot_model model = {spread, sizes[s][0], sizes[s][1], 200};
			double phase_px = (p + 0.5) / PHASES - 0.5;

			worst = fmax(worst, phase_bias(bench, scene, &model, phase_px,
						       0.5 - phase_px / 2));
		}
	return worst;
}

static void tell(struct blobs_bench *bench, const char *name, const double values[SPREAD_COUNT])
{
	static const char *const models[] = {"gauss", "moffat"};
	char model_name[64];
	double worst = 0;

	for (int m = 0; m < SPREAD_COUNT; m++) {
		snprintf(model_name, sizeof(model_name), "%s_%s", name, models[m]);
		json_object_set_new(bench->figures, model_name, json_real(values[m]));
		worst = fmax(worst, values[m]);
	}
	json_object_set_new(bench->figures, name, json_real(worst));
}

static void bench_models(struct blobs_bench *bench, struct scene *scene)
{
	double over[SPREAD_COUNT], own[SPREAD_COUNT], sigmas[SPREAD_COUNT];
	double saturated[SPREAD_COUNT], phase[SPREAD_COUNT];

	for (int m = 0; m < SPREAD_COUNT; m++) {
		struct score plain, clipped;

		score_pictures(bench, scene, (enum point_spread)m, 50, 230, &plain);
		score_pictures(bench, scene, (enum point_spread)m, 300, 1000, &clipped);
		over[m] = sqrt(plain.error_px2 / plain.bound_px2);
		own[m] = sqrt(plain.in_bounds / plain.count);
		sigmas[m] = plain.in_sigmas / (plain.count - plain.missed);
		saturated[m] = sqrt(clipped.error_px2 / clipped.count);
		phase[m] = worst_phase_bias(bench, scene, (enum point_spread)m);
	}
	tell(bench, "centroid_rmse_over_crlb", over);
	tell(bench, "centroid_rms_of_error_over_own_crlb", own);
	tell(bench, "centroid_nees", sigmas);
	tell(bench, "centroid_rmse_saturated_px", saturated);
	tell(bench, "centroid_phase_bias_px", phase);
}

void bench_centroids(struct blobs_bench *bench)
{
	struct scene *scene = calloc(1, sizeof(*scene));
	struct blob_settings settings = blob_settings_default();

	if (scene && blob_finder_create(&scene->finder, WIDTH, HEIGHT, &settings) == 0) {
		bench_models(bench, scene);
		blob_finder_destroy(scene->finder);
	}
	free(scene);
}
