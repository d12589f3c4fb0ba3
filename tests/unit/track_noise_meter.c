/*
 * The noise model from images whose noise is known.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "track/blobs/noise_meter.h"

#define WIDTH 320
#define HEIGHT 240
#define IMAGES 12

static struct noise_meter meter;
static uint8_t images[2][HEIGHT][WIDTH];

struct camera_of_test {
	double electrons_per_grey, read_noise, brightest;
	double flicker;    /* of the light, from image to image */
	int moving_rows;   /* in which every image shows something else */
	double fixed_grey; /* pattern of the pixels themselves */
};

static double light_at(const struct camera_of_test *camera, int x, int y, struct rng *pattern)
{
	double light = 12 + camera->brightest * x / WIDTH;

	return light + camera->fixed_grey * rng_normal(pattern) + (y & 1);
}

static void expose(const struct camera_of_test *camera, int image, struct rng *rng)
{
	struct rng pattern;
	double gain = 1 + camera->flicker * rng_normal(rng);

	rng_init(&pattern, 7, 7);
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++) {
			double light = gain * light_at(camera, x, y, &pattern), sigma;

			if (y < camera->moving_rows)
				light = 200 * rng_uniform(rng);
			sigma = sqrt(camera->read_noise * camera->read_noise +
				     fmax(light - 12, 0) / camera->electrons_per_grey);
			images[image % 2][y][x] = (uint8_t)fmin(
				fmax(floor(light + sigma * rng_normal(rng) + 0.5), 0), 255);
		}
}

static int measure(const struct camera_of_test *camera, struct noise_model *model)
{
	struct rng rng;

	rng_init(&rng, 3, 1);
	noise_meter_reset(&meter);
	for (int i = 0; i < IMAGES; i++) {
		expose(camera, i, &rng);
		if (i)
			noise_meter_add(&meter, images[i % 2][0], images[(i + 1) % 2][0], WIDTH,
					HEIGHT, WIDTH, WIDTH);
	}
	return noise_meter_solve(&meter, model);
}

static void assert_found(const struct camera_of_test *camera)
{
	struct noise_model model;

	assert_int_equal(measure(camera, &model), 0);
	assert_true(fabs(model.electrons_per_grey / camera->electrons_per_grey - 1) < 0.05);
	assert_true(fabs(model.electrons_per_grey - camera->electrons_per_grey) <
		    4 * model.electrons_per_grey_sigma + 0.03 * camera->electrons_per_grey);
}

static void electrons_and_read_noise_are_found(void **state)
{
	struct camera_of_test camera = {40, 2, 200, 0, 0, 0};
	struct noise_model model;

	(void)state;
	assert_found(&camera);
	assert_int_equal(measure(&camera, &model), 0);
	camera.brightest = 60; /* mostly dark */
	camera.electrons_per_grey = 10;
	assert_found(&camera);
}

static void read_noise_is_that_of_the_dark(void **state)
{
	struct camera_of_test camera = {40, 2, 0, 0, 0, 0};
	struct noise_model model;
	struct rng rng;

	(void)state;
	rng_init(&rng, 5, 1);
	noise_meter_reset(&meter);
	for (int i = 0; i < IMAGES; i++) { /* half of the images dark, half of them in light */
		camera.brightest = i < IMAGES / 2 ? 0 : 220;
		expose(&camera, i, &rng);
		if (i && i != IMAGES / 2)
			noise_meter_add(&meter, images[i % 2][0], images[(i + 1) % 2][0], WIDTH,
					HEIGHT, WIDTH, WIDTH);
	}
	assert_int_equal(noise_meter_solve(&meter, &model), 0);
	assert_true(model.dark_grey < 40);
	assert_true(fabs(model.read_noise_grey - 2) < 0.15);
}

static void pattern_flicker_and_motion_are_not_taken_for_noise(void **state)
{
	(void)state;
	assert_found(&(struct camera_of_test){40, 2, 200, 0, 0, 6});
	assert_found(&(struct camera_of_test){40, 2, 200, 0.01, 0, 0});
	assert_found(&(struct camera_of_test){40, 2, 200, 0, 10, 0});
}

static void one_light_alone_tells_nothing(void **state)
{
	struct noise_model model;

	(void)state;
	assert_int_equal(measure(&(struct camera_of_test){40, 1, 0, 0, 0, 0}, &model), -ENODATA);
}

static void noise_that_does_not_rise_is_refused(void **state)
{
	struct noise_model model;

	(void)state;
	assert_int_equal(measure(&(struct camera_of_test){1e6, 2, 200, 0, 0, 0}, &model), -ERANGE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(electrons_and_read_noise_are_found),
		cmocka_unit_test(read_noise_is_that_of_the_dark),
		cmocka_unit_test(pattern_flicker_and_motion_are_not_taken_for_noise),
		cmocka_unit_test(one_light_alone_tells_nothing),
		cmocka_unit_test(noise_that_does_not_rise_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
