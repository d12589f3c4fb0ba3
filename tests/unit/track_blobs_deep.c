/*
 * Spots in images of 9 to 16 bits: the same light says at least as much as in 8.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "track/blobs/blobs_parts.h"
#include "track_blobs_spots.h"

#define WIDTH 640
#define HEIGHT 512
#define PITCH_PX 40
#define SPOT_LIMIT 256
#define BACKGROUND 12
#define PICTURES 3

static uint16_t words[WIDTH * HEIGHT];
static struct blob_set set, again;

/* The light of a picture as a camera of so many bits gives it. */
static struct grey_image expose(const struct picture *picture, double read_noise, int bits,
				struct rng *rng)
{
	double unit = ldexp(1, bits - 8), white = ldexp(1, bits) - 1;

	for (int i = 0; i < WIDTH * HEIGHT; i++) {
		double light = (double)picture->light[i];
		double sigma = sqrt(read_noise * read_noise + light / 40);
		double value = floor((light + sigma * rng_normal(rng)) * unit + 0.5);

		value = fmin(fmax(value, 0), white);
		words[i] = (uint16_t)value;
		picture->pixels[i] = (uint8_t)value;
	}
	return (struct grey_image){bits > 8 ? (const uint8_t *)words : picture->pixels, WIDTH,
				   HEIGHT, bits > 8 ? 2 * WIDTH : WIDTH, bits};
}

struct score {
	int count, missed, extra, saturated;
	double rms_px, normalised, peak;
};

static int draw_spots(struct picture *picture, struct true_spot *spots, double amplitude,
		      double read_noise, struct rng *rng)
{
	int count = 0;

	for (int y = 30; y < HEIGHT - 30; y += PITCH_PX)
		for (int x = 30; x < WIDTH - 30; x += PITCH_PX) {
			spots[count] = (struct true_spot){
				.x_px = x + 6 * rng_uniform(rng),
				.y_px = y + 6 * rng_uniform(rng),
				.diameter_px = 2 + 4 * rng_uniform(rng),
				.axis_ratio = 1,
				.psf_px = 0.8,
				.amplitude = amplitude,
			};
			picture_add(picture, &spots[count++], read_noise);
		}
	return count;
}

static void add_to_score(struct score *score, const struct true_spot *spot)
{
	const struct blob *blob = blob_near(&set, spot->x_px, spot->y_px);
	double dx, dy;

	score->count++;
	if (!blob) {
		score->missed++;
		return;
	}
	dx = (double)blob->x_px - spot->x_px;
	dy = (double)blob->y_px - spot->y_px;
	score->rms_px += (dx * dx + dy * dy) / 2;
	score->normalised += (dx * dx + dy * dy) / 2 / pow((double)blob->sigma_px, 2);
	score->saturated += (blob->flags & BLOB_SATURATED) != 0;
	score->peak += blob->peak;
}

/* The same spots and light whatever the bits. */
static struct score score_bits(int bits, double amplitude, double read_noise)
{
	struct blob_settings settings = blob_settings_default();
	struct true_spot spots[SPOT_LIMIT];
	struct score score = {0};
	struct blob_finder *finder;
	struct rng rng;

	rng_init(&rng, 5, 9);
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	for (int p = 0; p < PICTURES; p++) {
		struct picture picture = picture_create(WIDTH, HEIGHT, BACKGROUND);
		int count = draw_spots(&picture, spots, amplitude, read_noise, &rng);
		struct grey_image image = expose(&picture, read_noise, bits, &rng);

		blob_finder_run(finder, &image, &set);
		for (int i = 0; i < count; i++)
			add_to_score(&score, &spots[i]);
		score.extra += (int)set.blob_count - count;
		picture_destroy(&picture);
	}
	blob_finder_destroy(finder);
	score.rms_px = sqrt(score.rms_px / score.count);
	score.normalised /= score.count;
	score.peak /= score.count;
	print_message("# %d bits, noise %.2f: rms %.4f px, (error / sigma)^2 %.2f, peak %.0f\n",
		      bits, read_noise, score.rms_px, score.normalised, score.peak);
	return score;
}

static void more_bits_of_the_same_light_are_no_worse(void **state)
{
	static const double noises[] = {0.25, 2};
	static const int depths[] = {9, 10, 12, 16};

	(void)state;
	for (int n = 0; n < 2; n++) {
		struct score bytes = score_bits(8, 120, noises[n]);

		for (size_t b = 0; b < sizeof(depths) / sizeof(depths[0]); b++) {
			struct score deep = score_bits(depths[b], 120, noises[n]);

			assert_int_equal(deep.missed, 0);
			assert_int_equal(deep.extra, 0);
			assert_int_equal(deep.saturated, 0);
			assert_true(deep.rms_px < 1.02 * bytes.rms_px);
			assert_true(deep.normalised > 0.6 && deep.normalised < 1.3);
			assert_true(fabs(deep.peak - bytes.peak) < 2);
		}
	}
}

static void full_scale_is_saturated_and_nothing_below(void **state)
{
	(void)state;
	for (int bits = 10; bits <= 16; bits += 2) {
		struct score clipped = score_bits(bits, 400, 2);
		struct score bright = score_bits(bits, 200, 2);

		assert_int_equal(clipped.saturated, clipped.count);
		assert_true(clipped.rms_px < 0.03);
		assert_int_equal(bright.saturated, 0);
	}
}

static struct blob_finder *finder_of(int width_px, int height_px)
{
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;

	assert_int_equal(blob_finder_create(&finder, width_px, height_px, &settings), 0);
	return finder;
}

static void both_builds_give_the_same_bits_of_words(void **state)
{
	static const int sizes[][2] = {{1, 1},     {15, 40},   {65, 9},
				       {130, 100}, {321, 203}, {577, 300}};
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 1);
	for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
		struct picture picture = picture_create(WIDTH, HEIGHT, BACKGROUND);
		struct blob_finder *finder = finder_of(sizes[i][0], sizes[i][1]);
		struct true_spot spots[SPOT_LIMIT];
		struct grey_image image;

		draw_spots(&picture, spots, 150 + 150 * (i % 2), 2, &rng);
		image = expose(&picture, 2, 12, &rng);
		image.width_px = sizes[i][0];
		image.height_px = sizes[i][1];
		memset(&set, 0, sizeof(set));
		memset(&again, 0, sizeof(again));
		blob_finder_run(finder, &image, &set);
		blob_finder_use(finder, blob_builds_any());
		blob_finder_run(finder, &image, &again);
		assert_memory_equal(&set, &again, sizeof(set));
		blob_finder_destroy(finder);
		picture_destroy(&picture);
	}
	assert_true(set.blob_count > 50);
}

/* One finder may get images of either width; bits above the full scale count as white. */
static void garbage_in_words_stays_within_bounds(void **state)
{
	struct blob_finder *finder = finder_of(WIDTH, HEIGHT);
	struct grey_image image = {(const uint8_t *)words, WIDTH, HEIGHT, 2 * WIDTH, 10};
	struct rng rng;

	(void)state;
	rng_init(&rng, 8, 1);
	for (int round = 0; round < 6; round++) {
		for (int i = 0; i < WIDTH * HEIGHT; i++)
			words[i] = (uint16_t)(rng_u32(&rng) >> (16 + 2 * round));
		for (image.bits = 8; image.bits <= 16; image.bits += 2) {
			image.stride_bytes = image.bits > 8 ? 2 * WIDTH : WIDTH;
			blob_finder_run(finder, &image, &set);
			assert_true(set.blob_count <= BLOB_MAX);
			for (uint32_t b = 0; b < set.blob_count; b++) {
				assert_true(set.blobs[b].sigma_px > 0);
				assert_true(isfinite(set.blobs[b].x_px + set.blobs[b].y_px));
				assert_true(set.blobs[b].peak < 256);
			}
		}
	}
	blob_finder_destroy(finder);
}

int main(void)
{
	static const struct CMUnitTest tests[] = {
		cmocka_unit_test(more_bits_of_the_same_light_are_no_worse),
		cmocka_unit_test(full_scale_is_saturated_and_nothing_below),
		cmocka_unit_test(both_builds_give_the_same_bits_of_words),
		cmocka_unit_test(garbage_in_words_stays_within_bounds),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
