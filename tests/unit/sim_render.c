/*
 * Pictures agree with the truth they were made from, in place, brightness and noise.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sim/render/canvas.h"
#include "sim/render/noise.h"
#include "sim/render/render.h"
#include "sim/render/spot.h"
#include "sim/world/scene_parts.h"

#define WIDTH 64

static const char *const kinds[] = {"gaussian", "tailed"};

static struct sim_scene *make_with(const char *name, uint64_t seed, const char *optics)
{
	struct sim_options options = {.scene = name, .seed = seed, .optics = optics};
	struct sim_scene *scene = NULL;

	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	return scene;
}

static struct sim_scene *make(const char *name, uint64_t seed)
{
	return make_with(name, seed, NULL);
}

static void check_spot(struct spot spot, const struct blur *blur)
{
	static float light[SPOT_WINDOW_MAX * SPOT_WINDOW_MAX];
	double sum = 0, x_sum = 0, y_sum = 0;
	double area = M_PI * fabs(spot.axes_px[0][0] * spot.axes_px[1][1] -
				  spot.axes_px[0][1] * spot.axes_px[1][0]);

	struct pixel_window w = spot_window(&spot, blur, WIDTH, WIDTH);
	const float *pixel = light;

	spot_fill(&spot, blur, &w, light);
	for (int y = w.y0; y < w.y1; y++)
		for (int x = w.x0; x < w.x1; x++, pixel++) {
			sum += *pixel;
			x_sum += x * *pixel;
			y_sum += y * *pixel;
		}
	assert_true(fabs(x_sum / sum - spot.centre_px[0]) < 5e-4);
	assert_true(fabs(y_sum / sum - spot.centre_px[1]) < 5e-4);
	assert_true(fabs(sum / (spot.brightness * area) - 1) < 1e-3);
}

static void spot_lies_where_it_is_put_at_every_phase_and_size(void **state)
{
	static struct blur blur;
	static const double radii_px[] = {0.6, 1.0, 1.39, 1.41, 3.0};

	(void)state;
	blur_init(&blur, 0.9);
	for (size_t r = 0; r < sizeof(radii_px) / sizeof(radii_px[0]); r++)
		for (int phase = 0; phase < 100; phase++)
			check_spot((struct spot){.centre_px = {30 + 0.1 * (phase % 10),
							       31 + 0.1 * (phase / 10)},
						 .axes_px = {{radii_px[r], 0.2 * radii_px[r]},
							     {0, 0.7 * radii_px[r]}},
						 .brightness = 300},
				   &blur);
}

static void spot_beyond_the_border_is_cut_off(void **state)
{
	static struct blur blur;
	static float light[SPOT_WINDOW_MAX * SPOT_WINDOW_MAX];
	struct spot spot = {.axes_px = {{1, 0}, {0, 1}}, .brightness = 100};

	(void)state;
	blur_init(&blur, 0.9);
	for (double x = -40; x < WIDTH + 40; x += 3.3)
		for (double y = -40; y < WIDTH + 40; y += 3.3) {
			spot.centre_px[0] = x;
			spot.centre_px[1] = y;
			struct pixel_window w = spot_window(&spot, &blur, WIDTH, WIDTH);

			spot_fill(&spot, &blur, &w, light);
			assert_true(w.x0 >= 0 && w.y0 >= 0 && w.x1 <= WIDTH && w.y1 <= WIDTH);
		}
}

struct moments {
	double mean, variance;
};

static struct moments moments_of(const uint8_t *values, int count)
{
	double sum = 0, squares = 0;

	for (int i = 0; i < count; i++) {
		sum += values[i];
		squares += (double)values[i] * values[i];
	}
	double mean = sum / count;

	return (struct moments){mean, squares / count - mean * mean};
}

static void noise_is_photons_readout_and_rounding(void **state)
{
	static uint8_t values[400000];
	static float light[400000];
	const size_t count = sizeof(values);
	struct noise *noise;
	struct rng rng;

	(void)state;
	rng_init(&rng, 1, 1);
	assert_int_equal(noise_create(&noise, 10), 0);
	for (int grey = 0; grey <= 150; grey += 50) {
		for (size_t i = 0; i < count; i++)
			light[i] = (float)grey;
		noise_expose(noise, &rng, light, values, count);
		struct moments m = moments_of(values, (int)count);
		double expected = 4.0 + (10 + grey) / 40.0 + 1.0 / 12.0;

		assert_true(fabs(m.mean - 10 - grey) < 0.02);
		assert_true(fabs(m.variance / expected - 1) < 0.02);
	}
	noise_destroy(noise);
}

/* A corner of the picture where no marker comes. */
static struct moments corner(const uint8_t *image, int width_px)
{
	static uint8_t values[200 * 300];

	for (int y = 0; y < 200; y++)
		memcpy(values + y * 300, image + (long)y * width_px, 300);
	return moments_of(values, sizeof(values));
}

static void fast_noise_has_the_statistics_of_full_noise(void **state)
{
	struct sim_scene *scene = make("talking", 6);
	struct sim_renderer *full, *fast;
	int width_px, height_px;
	double full_sum = 0, fast_sum = 0;

	(void)state;
	assert_int_equal(sim_renderer_create(&full, scene, 1, SIM_NOISE_FULL), 0);
	assert_int_equal(sim_renderer_create(&fast, scene, 1, SIM_NOISE_FAST), 0);
	for (uint64_t shot = 0; shot < 10; shot++) {
		struct moments a = corner(sim_render(full, shot, &width_px, &height_px), 1280);
		struct moments b = corner(sim_render(fast, shot, &width_px, &height_px), 1280);

		assert_true(fabs(a.mean - b.mean) < 0.05);
		full_sum += a.variance;
		fast_sum += b.variance;
	}
	assert_true(fabs(full_sum / fast_sum - 1) < 0.02);
	sim_renderer_destroy(full);
	sim_renderer_destroy(fast);
	sim_scene_destroy(scene);
}

static void fast_pictures_do_not_share_their_noise(void **state)
{
	struct sim_scene *scene = make("rest", 6);
	struct sim_renderer *renderer;
	static uint8_t before[1280 * 1024];
	int width_px, height_px;
	double product = 0, variance = 0, mean;

	(void)state;
	assert_int_equal(sim_renderer_create(&renderer, scene, 0, SIM_NOISE_FAST), 0);
	memcpy(before, sim_render(renderer, 1, &width_px, &height_px), sizeof(before));
	const uint8_t *after = sim_render(renderer, 2, &width_px, &height_px);

	mean = corner(before, 1280).mean;
	for (int i = 0; i < 200 * 1280; i++) {
		product += (before[i] - mean) * (after[i] - mean);
		variance += (before[i] - mean) * (before[i] - mean);
	}
	assert_true(fabs(product / variance) < 0.02);
	sim_renderer_destroy(renderer);
	sim_scene_destroy(scene);
}

static void same_shot_is_the_same_picture_in_any_order(void **state)
{
	static const uint64_t order[] = {3, 900, 4, 3, 0, 4, 900};
	static uint8_t first[1280 * 1024];

	(void)state;
	for (int way = 0; way < 4; way++) {
		struct sim_scene *scene = make_with("talking", 6, kinds[way / 2]);
		enum sim_noise noise = way % 2 ? SIM_NOISE_FAST : SIM_NOISE_FULL;
		struct sim_renderer *one, *other;
		int width_px, height_px;

		assert_int_equal(sim_renderer_create(&one, scene, 2, noise), 0);
		assert_int_equal(sim_renderer_create(&other, scene, 2, noise), 0);
		memcpy(first, sim_render(one, 3, &width_px, &height_px), sizeof(first));
		for (size_t i = 0; i < sizeof(order) / sizeof(order[0]); i++)
			sim_render(other, order[i], &width_px, &height_px);
		assert_memory_not_equal(first, sim_render(other, 4, &width_px, &height_px),
					sizeof(first));
		assert_memory_equal(first, sim_render(other, 3, &width_px, &height_px),
				    sizeof(first));
		sim_renderer_destroy(one);
		sim_renderer_destroy(other);
		sim_scene_destroy(scene);
	}
}

static void light_of_overlapping_windows_adds_up(void **state)
{
	const struct canvas_plan plan = {
		.width_px = 16, .height_px = 16, .frame_count = 1, .black_grey = 10};
	struct pixel_window windows[] = {{4, 4, 10, 10}, {6, 6, 12, 12}, {8, 3, 9, 14}};
	struct canvas canvas;
	struct rng rng;
	static double sum[16 * 16];

	(void)state;
	rng_init(&rng, 1, 1);
	assert_int_equal(canvas_init(&canvas, &plan, &rng), 0);
	for (int shot = 0; shot < 2000; shot++) {
		canvas_clear(&canvas, &rng);
		for (int i = 0; i < 3; i++) {
			float *light = canvas_add_window(&canvas, windows[i]);

			for (int p = 0; p < pixel_window_count(&windows[i]); p++)
				light[p] = 20;
		}
		const uint8_t *image = canvas_expose(&canvas, &rng);

		for (int p = 0; p < 16 * 16; p++)
			sum[p] += image[p] / 2000.0;
	}
	for (int p = 0; p < 16 * 16; p++) {
		int covering = 0;

		for (int i = 0; i < 3; i++)
			covering += p % 16 >= windows[i].x0 && p % 16 < windows[i].x1 &&
				    p / 16 >= windows[i].y0 && p / 16 < windows[i].y1;
		assert_true(fabs(sum[p] - 10 - 20 * covering) < 0.3);
	}
	canvas_finish(&canvas);
}

struct isolated {
	bool alone; /* no other spot near */
	double pixel[2];
};

static void project_all(const struct sim_scene *scene, uint32_t camera,
			const struct sim_truth *truth, struct isolated spots[LABEL_MAX])
{
	for (uint32_t m = 0; m < truth->marker_count; m++) {
		spots[m].alone = truth->markers[m].visible_mask >> camera & 1;
		sim_camera_project(&scene->cameras[camera], truth->markers[m].p_stage_m,
				   spots[m].pixel);
	}
	for (uint32_t m = 0; m < truth->marker_count; m++)
		for (uint32_t i = 0; i < truth->marker_count; i++)
			if (i != m && hypot(spots[i].pixel[0] - spots[m].pixel[0],
					    spots[i].pixel[1] - spots[m].pixel[1]) < 16)
				spots[m].alone = false;
}

/* The plain centroid and peak of a window around the pixel. */
static int measure(const uint8_t *image, double background, const double pixel[2], double out[2])
{
	int cx = (int)lround(pixel[0]), cy = (int)lround(pixel[1]), peak = 0;
	double sum = 0, x_sum = 0, y_sum = 0;

	for (int y = cy - 5; y <= cy + 5; y++)
		for (int x = cx - 5; x <= cx + 5; x++) {
			int value = image[y * 1280 + x];

			peak = value > peak ? value : peak;
			sum += value - background;
			x_sum += (value - background) * x;
			y_sum += (value - background) * y;
		}
	out[0] = x_sum / sum;
	out[1] = y_sum / sum;
	return peak;
}

struct offsets {
	double x, y;
	int count;
};

static void add_offsets(const struct sim_scene *scene, uint64_t shot, const uint8_t *image,
			int width_px, struct offsets *sum)
{
	static struct sim_truth truth;
	static struct isolated spots[LABEL_MAX];
	double background = corner(image, width_px).mean, found[2];

	sim_scene_truth(scene, 1e-9 * (double)sim_scene_mid_exposure_ns(scene, shot), &truth);
	project_all(scene, 2, &truth, spots);
	for (uint32_t m = 0; m < truth.marker_count; m++) {
		if (!spots[m].alone || scene->layout.markers[m].rigid)
			continue;
		int peak = measure(image, background, spots[m].pixel, found);

		if (peak < 100 || peak == 255)
			continue;
		sum->x += found[0] - spots[m].pixel[0];
		sum->y += found[1] - spots[m].pixel[1];
		sum->count++;
	}
}

static void rendered_spots_lie_on_the_projected_truth(void **state)
{
	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct sim_scene *scene = make_with("talking", 6, kinds[kind]);
		struct sim_renderer *renderer;
		struct offsets sum = {0, 0, 0};
		int width_px, height_px;

		assert_int_equal(sim_renderer_create(&renderer, scene, 2, SIM_NOISE_FAST), 0);
		for (uint64_t shot = 0; shot < 900; shot += 5) {
			const uint8_t *image = sim_render(renderer, shot, &width_px, &height_px);

			add_offsets(scene, shot, image, width_px, &sum);
		}
		print_message("# %s: %.4f %.4f px of %d\n", kinds[kind], sum.x / sum.count,
			      sum.y / sum.count, sum.count);
		assert_true(sum.count > 1800);
		assert_true(fabs(sum.x / sum.count) < 0.005);
		assert_true(fabs(sum.y / sum.count) < 0.005);
		sim_renderer_destroy(renderer);
		sim_scene_destroy(scene);
	}
}

static void face_markers_are_bright_and_the_band_saturates(void **state)
{
	static struct sim_truth truth;
	struct sim_scene *scene = make("rest", 2);
	int width_px, height_px, bright = 0, seen = 0, saturated = 0;

	(void)state;
	sim_scene_truth(scene, 0, &truth);
	for (uint32_t c = 0; c < 4; c++) {
		struct sim_renderer *renderer;

		assert_int_equal(sim_renderer_create(&renderer, scene, c, SIM_NOISE_FULL), 0);
		const uint8_t *image = sim_render(renderer, 0, &width_px, &height_px);
		for (uint32_t m = 0; m < truth.marker_count; m++) {
			double pixel[2], found[2];

			if (!(truth.markers[m].visible_mask >> c & 1))
				continue;
			sim_camera_project(&scene->cameras[c], truth.markers[m].p_stage_m, pixel);
			int peak = measure(image, 10, pixel, found);

			assert_true(peak > 10 + 15); /* what counts as seen can be found */
			if (scene->layout.markers[m].rigid) {
				saturated += peak == 255;
				continue;
			}
			seen++;
			bright += peak >= 80 && peak <= 250;
		}
		sim_renderer_destroy(renderer);
	}
	assert_true(saturated >= 4);
	assert_true(bright > 0.75 * seen);
	sim_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spot_lies_where_it_is_put_at_every_phase_and_size),
		cmocka_unit_test(spot_beyond_the_border_is_cut_off),
		cmocka_unit_test(noise_is_photons_readout_and_rounding),
		cmocka_unit_test(fast_noise_has_the_statistics_of_full_noise),
		cmocka_unit_test(fast_pictures_do_not_share_their_noise),
		cmocka_unit_test(same_shot_is_the_same_picture_in_any_order),
		cmocka_unit_test(light_of_overlapping_windows_adds_up),
		cmocka_unit_test(rendered_spots_lie_on_the_projected_truth),
		cmocka_unit_test(face_markers_are_bright_and_the_band_saturates),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
