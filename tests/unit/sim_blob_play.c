/*
 * Blobs without pictures are such as the blob finder finds in pictures of the same shots.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/sort.h"
#include "sim/blob_play.h"
#include "sim/blob_play_spots.h"
#include "sim/render/optics.h"
#include "sim/render/render.h"
#include "sim/world/scene_parts.h"
#include "track/blobs/blobs.h"

#define SHOTS 12
#define SHOT_STEP 37
#define NEAR_PX 0.5
#define PAIR_MAX 4000

static const char *const names[] = {"gaussian", "tailed"};

struct pairs {
	int played, found, count;
	double area[PAIR_MAX], peak[PAIR_MAX], sigma[PAIR_MAX], spread[PAIR_MAX]; /* ratios */
};

static struct sim_scene *make(const char *name, const char *optics, uint32_t cameras)
{
	const struct sim_options options = {
		.scene = name, .seed = 8, .camera_count = cameras, .optics = optics};
	struct sim_scene *scene;

	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	return scene;
}

static void add_pair(struct pairs *pairs, const struct blob *played, const struct blob *found)
{
	if ((played->flags | found->flags) & (BLOB_MERGED | BLOB_EDGE | BLOB_SATURATED) ||
	    pairs->count == PAIR_MAX)
		return;
	pairs->area[pairs->count] = (double)(played->area_px2 / found->area_px2);
	pairs->peak[pairs->count] = (double)played->peak / found->peak;
	pairs->sigma[pairs->count] = (double)(played->sigma_px / found->sigma_px);
	pairs->spread[pairs->count] = (double)((played->shape_px2[0] + played->shape_px2[2]) /
					       (found->shape_px2[0] + found->shape_px2[2]));
	pairs->count++;
}

static void compare(struct pairs *pairs, const struct blob_set *played,
		    const struct blob_set *found)
{
	pairs->played += (int)played->blob_count;
	pairs->found += (int)found->blob_count;
	for (uint32_t i = 0; i < played->blob_count; i++)
		for (uint32_t j = 0; j < found->blob_count; j++)
			if (fabsf(played->blobs[i].x_px - found->blobs[j].x_px) < (float)NEAR_PX &&
			    fabsf(played->blobs[i].y_px - found->blobs[j].y_px) < (float)NEAR_PX)
				add_pair(pairs, &played->blobs[i], &found->blobs[j]);
}

static void collect(const struct sim_scene *scene, uint32_t camera, struct pairs *pairs)
{
	static const struct blob_play play = {0};
	static struct blob_set played, found;
	static struct sim_truth truth;
	const struct sim_camera *eye = &scene->cameras[camera];
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;
	struct sim_renderer *renderer;
	struct grey_image image;

	assert_int_equal(sim_renderer_create(&renderer, scene, camera, SIM_NOISE_FAST), 0);
	assert_int_equal(blob_finder_create(&finder, eye->width_px, eye->height_px, &settings), 0);
	for (uint64_t shot = 100; shot < 100 + SHOTS * SHOT_STEP; shot += SHOT_STEP) {
		sim_scene_truth(scene, 1e-9 * (double)sim_scene_mid_exposure_ns(scene, shot),
				&truth);
		blob_play_camera(&play, scene, &truth, shot, camera, &played);
		image.pixels = sim_render(renderer, shot, &image.width_px, &image.height_px);
		image.stride_bytes = image.width_px;
		image.bits = 8;
		blob_finder_run(finder, &image, &found);
		compare(pairs, &played, &found);
	}
	blob_finder_destroy(finder);
	sim_renderer_destroy(renderer);
}

static double median(double *values, int count)
{
	sort_doubles(values, (size_t)count);
	return values[count / 2];
}

static bool is_within(double ratio, double share)
{
	return ratio < 1 + share && ratio > 1 / (1 + share);
}

static void blobs_are_as_a_finder_finds_them(void **state)
{
	static struct pairs pairs;

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct sim_scene *scene = make("talking", names[kind], 4);

		memset(&pairs, 0, sizeof(pairs));
		for (uint32_t c = 0; c < 4; c++)
			collect(scene, c, &pairs);
		double area = median(pairs.area, pairs.count);
		double peak = median(pairs.peak, pairs.count);
		double sigma = median(pairs.sigma, pairs.count);
		double spread = median(pairs.spread, pairs.count);

		print_message("# %s: %d played, %d found, %d alike; played over found: area %.2f, "
			      "peak %.2f, sigma %.2f, spread %.2f\n",
			      names[kind], pairs.played, pairs.found, pairs.count, area, peak,
			      sigma, spread);
		assert_true(pairs.count > 0.8 * pairs.found);
		assert_true(is_within((double)pairs.played / pairs.found, 0.04));
		assert_true(is_within(area, 0.25));
		assert_true(is_within(peak, 0.15));
		assert_true(is_within(sigma, 0.25));
		assert_true(is_within(spread, 0.25));
		sim_scene_destroy(scene);
	}
}

/* Fisher information of the pixels themselves, from the noise-free image moved a little. */
static double pixel_bound_px(const struct optics *optics, const struct spot *spot)
{
	static float here[SPOT_WINDOW_MAX * SPOT_WINDOW_MAX], there[sizeof(here) / sizeof(*here)];
	const double step_px = 0.01;
	const double variance = 4 + BOUND_BLACK_GREY / 40 + 1 / 12.0;
	struct pixel_window w = optics_window(optics, spot);
	struct spot moved = *spot;
	double information = 0;

	moved.centre_px[0] += step_px;
	optics_fill((struct optics *)optics, spot, &w, here);
	optics_fill((struct optics *)optics, &moved, &w, there);
	for (int i = 0; i < pixel_window_count(&w); i++) {
		double slope = (double)(there[i] - here[i]) / step_px;

		if (here[i] < 245)
			information += slope * slope / (variance + (double)here[i] / 40);
	}
	return 1 / sqrt(information);
}

static void bound_is_that_of_the_pixels(void **state)
{
	static struct bound_table table;
	struct optics optics;
	double worst = 0;

	(void)state;
	assert_int_equal(optics_init(&optics, SIM_OPTICS_GAUSSIAN, 0.5, 1280, 1024), 0);
	bound_table_init(&table, 4 + BOUND_BLACK_GREY / 40 + 1 / 12.0, 40);
	for (double radius_px = 0.4; radius_px < 6; radius_px *= 1.3)
		for (double grey = 40; grey < 200; grey *= 1.5) {
			struct spot spot = {.centre_px = {500.2, 400.4},
					    .axes_px = {{radius_px, 0}, {0, radius_px}},
					    .brightness = grey};
			double blur_px =
				sqrt(pow(optics_sigma_px(SIM_OPTICS_GAUSSIAN, 0.5), 2) + 1 / 12.0);
			double said = (double)bound_of(&table, radius_px / blur_px, grey).sigma_px;

			worst = fmax(worst, fabs(said / pixel_bound_px(&optics, &spot) - 1));
		}
	print_message("# worst %.3f\n", worst);
	assert_true(worst < 0.06);
	optics_finish(&optics);
}

struct errors {
	double sum2;
	int count, outliers;
};

/* Of blobs over what they claim. */
static struct errors errors_of(const char *optics)
{
	static const struct blob_play play = {0};
	static struct blob_set set;
	static struct sim_truth truth;
	struct sim_scene *scene = make("rest", optics, 4);
	struct errors errors = {0, 0, 0};

	for (uint64_t shot = 0; shot < 400; shot++) {
		sim_scene_truth(scene, 0.5, &truth);
		blob_play_camera(&play, scene, &truth, shot, 1, &set);
		for (uint32_t m = 0; m < truth.marker_count; m++) {
			double q[2];

			sim_camera_project(&scene->cameras[1], truth.markers[m].p_stage_m, q);
			for (uint32_t b = 0; b < set.blob_count; b++) {
				double dx = (double)set.blobs[b].x_px - q[0];
				double dy = (double)set.blobs[b].y_px - q[1];
				double sigma = (double)set.blobs[b].sigma_px;

				if (set.blobs[b].flags & BLOB_MERGED || hypot(dx, dy) > 0.5)
					continue;
				errors.sum2 += (dx * dx + dy * dy) / (2 * sigma * sigma);
				errors.outliers += fabs(dx) > 3.5 * sigma;
				errors.count++;
			}
		}
	}
	sim_scene_destroy(scene);
	return errors;
}

static void errors_are_as_claimed_and_one_model_has_outliers(void **state)
{
	struct errors even = errors_of("gaussian"), tailed = errors_of("tailed");

	(void)state;
	assert_true(even.count > 10000 && tailed.count > 10000);
	assert_true(fabs(even.sum2 / even.count - 1) < 0.05);
	assert_true(fabs(tailed.sum2 / tailed.count - 1) < 0.05);
	assert_true(even.outliers < 0.001 * even.count);
	assert_true(tailed.outliers > 0.003 * tailed.count);
}

static struct play_spot spot_at(double x_px, double radius_px)
{
	return (struct play_spot){.x_px = x_px,
				  .y_px = 100,
				  .sigma_px = 0.02,
				  .light = radius_px * radius_px,
				  .reach_px = 2 * radius_px,
				  .core_px = radius_px,
				  .area_px2 = 10,
				  .peak_grey = 100};
}

static void spots_merge_by_their_sizes(void **state)
{
	(void)state;
	for (double radius_px = 1; radius_px < 5; radius_px += 1) {
		struct play_spot near[2] = {spot_at(50, radius_px),
					    spot_at(50 + 1.9 * radius_px, radius_px)};
		struct play_spot touching[2] = {spot_at(50, radius_px),
						spot_at(50 + 2.5 * radius_px, radius_px)};
		struct play_spot apart[2] = {spot_at(50, radius_px),
					     spot_at(50 + 4.1 * radius_px, radius_px)};

		assert_int_equal(play_spots_merge(near, 2, 0), 1);
		assert_true(near[0].spread_px2[0] > 0.6 * radius_px * radius_px);
		assert_true(near[0].sigma_px < 0.03); /* a finder would not know */
		assert_true(fabs(near[0].x_px - 50 - 0.95 * radius_px) < 1e-9);
		assert_int_equal(play_spots_merge(touching, 2, 0), 2);
		assert_true(touching[0].flags & touching[1].flags & BLOB_MERGED);
		assert_true(touching[0].sigma_px > 0.03);
		assert_int_equal(play_spots_merge(apart, 2, 0), 2);
		assert_int_equal(apart[0].flags | apart[1].flags, 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(blobs_are_as_a_finder_finds_them),
		cmocka_unit_test(bound_is_that_of_the_pixels),
		cmocka_unit_test(errors_are_as_claimed_and_one_model_has_outliers),
		cmocka_unit_test(spots_merge_by_their_sizes),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
