/*
 * Where the blob finder says the spots are, against where they were drawn.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "track_blobs_spots.h"

#define WIDTH 640
#define HEIGHT 512
#define SPOT_LIMIT 256

/* Spots on a grid, each shifted at random, with parameters between the two given ones. */
struct field {
	struct true_spot low, high;
	int pitch_px;
	double background, glow, read_noise;
	int sharp; /* the glow is a plateau */
};

struct score {
	int count, missed, extra, flagged, merged;
	double rms_px, bound_px; /* of one axis; a missed spot counts as 1 px */
	double normalised;       /* mean of (error / sigma)^2 */
};

static double between(struct rng *rng, double low, double high)
{
	return low + (high - low) * rng_uniform(rng);
}

static struct true_spot draw(const struct field *field, struct rng *rng, int x, int y)
{
	const struct true_spot *low = &field->low, *high = &field->high;

	return (struct true_spot){
		.x_px = x + between(rng, -3, 3),
		.y_px = y + between(rng, -3, 3),
		.diameter_px = between(rng, low->diameter_px, high->diameter_px),
		.axis_ratio = between(rng, low->axis_ratio, high->axis_ratio),
		.angle_rad = between(rng, 0, M_PI),
		.psf_px = between(rng, low->psf_px, high->psf_px),
		.amplitude = between(rng, low->amplitude, high->amplitude),
	};
}

static void score_spot(struct score *score, const struct blob_set *set,
		       const struct true_spot *spot, double bound)
{
	const struct blob *blob = blob_near(set, spot->x_px, spot->y_px);
	double dx, dy;

	score->count++;
	score->bound_px += bound * bound;
	if (!blob) {
		score->missed++;
		score->rms_px += 1;
		return;
	}
	dx = (double)blob->x_px - spot->x_px;
	dy = (double)blob->y_px - spot->y_px;
	score->rms_px += (dx * dx + dy * dy) / 2;
	score->normalised += (dx * dx + dy * dy) / 2 / pow((double)blob->sigma_px, 2);
	score->flagged += blob->flags != 0;
	score->merged += (blob->flags & BLOB_MERGED) != 0;
}

static void score_picture(struct score *score, const struct field *field,
			  struct blob_finder *finder, struct rng *rng)
{
	struct picture picture = picture_create(WIDTH, HEIGHT, field->background);
	struct grey_image image = picture_image(&picture);
	struct true_spot spots[SPOT_LIMIT];
	double bounds[SPOT_LIMIT];
	static struct blob_set set;
	int count = 0;

	if (field->glow > 0)
		picture_add_glow(&picture, 320, 256, field->sharp ? 150 : 120, field->glow,
				 field->sharp);
	for (int y = 30; y < HEIGHT - 30; y += field->pitch_px)
		for (int x = 30; x < WIDTH - 30; x += field->pitch_px) {
			spots[count] = draw(field, rng, x, y);
			bounds[count] = picture_add(&picture, &spots[count], field->read_noise);
			count++;
		}
	picture_expose(&picture, field->read_noise, rng);
	blob_finder_run(finder, &image, &set);
	for (int i = 0; i < count; i++)
		score_spot(score, &set, &spots[i], bounds[i]);
	score->extra += (int)set.blob_count - count;
	picture_destroy(&picture);
}

static struct score run_field(const struct field *field, int pictures)
{
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;
	struct score score = {0};
	struct rng rng;

	rng_init(&rng, 11, 3);
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	for (int i = 0; i < pictures; i++)
		score_picture(&score, field, finder, &rng);
	blob_finder_destroy(finder);
	score.normalised /= score.count - score.missed;
	score.rms_px = sqrt(score.rms_px / score.count);
	score.bound_px = sqrt(score.bound_px / score.count);
	return score;
}

static const struct field ordinary = {
	.low = {.diameter_px = 2, .axis_ratio = 1, .psf_px = 0.6, .amplitude = 50},
	.high = {.diameter_px = 8, .axis_ratio = 1, .psf_px = 1.2, .amplitude = 230},
	.pitch_px = 40,
	.background = 10,
	.read_noise = 2,
};

static void centroids_come_near_the_cramer_rao_bound(void **state)
{
	struct score score = run_field(&ordinary, 3);

	(void)state;
	assert_int_equal(score.missed, 0);
	assert_int_equal(score.extra, 0);
	assert_int_equal(score.flagged, 0);
	assert_true(score.rms_px < 1.15 * score.bound_px);
}

static void sigma_is_the_error_that_is_made(void **state)
{
	struct score score = run_field(&ordinary, 8);

	(void)state;
	assert_true(score.normalised > 0.9);
	assert_true(score.normalised < 1.1);
}

static void saturated_spots_are_flagged_and_good_to_a_fiftieth_pixel(void **state)
{
	struct field field = ordinary;
	struct score score;

	(void)state;
	field.low.amplitude = 300;
	field.high.amplitude = 1000;
	score = run_field(&field, 1);
	assert_int_equal(score.flagged, score.count);
	assert_int_equal(score.merged, 0);
	assert_int_equal(score.missed, 0);
	assert_true(score.rms_px < 0.015);
}

static void sigma_of_clipped_spots_follows_their_rims(void **state)
{
	static const double brightest[] = {320, 1000};

	(void)state;
	for (int k = 0; k < 2; k++) {
		struct field field = ordinary;
		struct score score;

		field.low.amplitude = brightest[k] - 50;
		field.high.amplitude = brightest[k];
		score = run_field(&field, 4);
		assert_true(score.normalised > 0.75);
		assert_true(score.normalised < 1.33);
	}
}

static void near_markers_are_as_good(void **state)
{
	struct field field = ordinary;
	struct score score;

	(void)state;
	field.low.diameter_px = 8;
	field.high.diameter_px = 20;
	field.pitch_px = 60;
	score = run_field(&field, 2);
	assert_int_equal(score.missed, 0);
	assert_int_equal(score.extra, 0);
	assert_true(score.rms_px < 1.25 * score.bound_px);
}

static void discs_seen_obliquely_are_one_spot(void **state)
{
	struct field field = ordinary;
	struct score score;

	(void)state;
	field.low.axis_ratio = 0.3;
	field.high.diameter_px = 16;
	score = run_field(&field, 2);
	assert_int_equal(score.missed, 0);
	assert_int_equal(score.extra, 0);
	assert_int_equal(score.merged, 0);
	assert_true(score.rms_px < 1.25 * score.bound_px);
}

static void skin_glow_neither_bends_nor_adds_spots(void **state)
{
	struct field field = ordinary;
	struct score score;

	(void)state;
	field.glow = 40;
	field.high.amplitude = 200;
	score = run_field(&field, 2);
	assert_int_equal(score.missed, 0);
	assert_int_equal(score.extra, 0);
	assert_true(score.rms_px < 1.25 * score.bound_px);
}

static void the_rim_of_a_glow_is_no_spot(void **state)
{
	struct field field = ordinary;
	struct score score;

	(void)state;
	field.glow = 30;
	field.sharp = 1;
	field.high.amplitude = 200;
	score = run_field(&field, 2);
	assert_int_equal(score.extra + score.missed, 0);
	assert_true(score.missed <= 2); /* spots across the rim */
	assert_true(score.normalised < 1.5);
}

/* Mean error over many exposures of one phase, the worst of both axes. */
static double phase_bias(struct blob_finder *finder, double diameter_px, double phase_px)
{
	struct picture picture = picture_create(WIDTH, HEIGHT, 10);
	struct grey_image image = picture_image(&picture);
	double sum_x = 0, sum_y = 0;
	static struct blob_set set;
	struct rng rng;
	int count = 0;

	rng_init(&rng, 5, 1);
	for (int y = 30; y < HEIGHT - 30; y += 30)
		for (int x = 30; x < WIDTH - 30; x += 30)
			picture_add(&picture,
				    &(struct true_spot){x + phase_px, y - phase_px, diameter_px, 1,
							0, 0.6, 200},
				    1);
	picture_expose(&picture, 1, &rng);
	blob_finder_run(finder, &image, &set);
	for (uint32_t b = 0; b < set.blob_count; b++, count++) {
		double x = (double)set.blobs[b].x_px - phase_px;
		double y = (double)set.blobs[b].y_px + phase_px;

		sum_x += x - 30 * round(x / 30);
		sum_y += y - 30 * round(y / 30);
	}
	picture_destroy(&picture);
	assert_true(count > 250);
	return fmax(fabs(sum_x), fabs(sum_y)) / count;
}

static void the_pixel_grid_does_not_pull(void **state)
{
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;

	(void)state;
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	for (int i = 0; i < 4; i++) {
		assert_true(phase_bias(finder, 2, i * 0.15) < 0.004);
		assert_true(phase_bias(finder, 5, i * 0.15) < 0.004);
	}
	blob_finder_destroy(finder);
}

/* Counts faint spots that are found, and those of them that are off by five of their sigmas. */
static int count_far_off(struct blob_finder *finder, double amplitude, int *found)
{
	struct picture picture = picture_create(WIDTH, HEIGHT, 10);
	struct grey_image image = picture_image(&picture);
	struct true_spot spots[SPOT_LIMIT];
	static struct blob_set set;
	int count = 0, far = 0;
	struct rng rng;

	rng_init(&rng, 21, 3);
	for (int y = 30; y < HEIGHT - 30; y += 30)
		for (int x = 30; x < WIDTH - 30; x += 40) {
			struct true_spot *spot = &spots[count++];

			*spot = draw(&ordinary, &rng, x, y);
			spot->diameter_px = spot->psf_px = 1;
			spot->amplitude = amplitude;
			picture_add(&picture, spot, 2);
		}
	picture_expose(&picture, 2, &rng);
	blob_finder_run(finder, &image, &set);
	for (int i = 0; i < count; i++) {
		const struct blob *blob = blob_near(&set, spots[i].x_px, spots[i].y_px);

		if (!blob)
			continue;
		double off_px = hypot((double)blob->x_px - spots[i].x_px,
				      (double)blob->y_px - spots[i].y_px);
		++*found;
		far += off_px > 5 * (double)blob->sigma_px;
	}
	picture_destroy(&picture);
	return far;
}

static void a_pixel_above_the_threshold_hardly_tells_a_place(void **state)
{
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;
	int found = 0, far = 0;

	(void)state;
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	for (int amplitude = 12; amplitude <= 24; amplitude += 2)
		far += count_far_off(finder, amplitude, &found);
	blob_finder_destroy(finder);
	assert_true(found > 500);
	assert_int_equal(far, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(centroids_come_near_the_cramer_rao_bound),
		cmocka_unit_test(sigma_is_the_error_that_is_made),
		cmocka_unit_test(saturated_spots_are_flagged_and_good_to_a_fiftieth_pixel),
		cmocka_unit_test(sigma_of_clipped_spots_follows_their_rims),
		cmocka_unit_test(near_markers_are_as_good),
		cmocka_unit_test(discs_seen_obliquely_are_one_spot),
		cmocka_unit_test(skin_glow_neither_bends_nor_adds_spots),
		cmocka_unit_test(the_rim_of_a_glow_is_no_spot),
		cmocka_unit_test(the_pixel_grid_does_not_pull),
		cmocka_unit_test(a_pixel_above_the_threshold_hardly_tells_a_place),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
