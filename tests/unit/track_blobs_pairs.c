/*
 * Spots with a dark pixel between them: what the neighbour's skirt does to a centroid is in its
 * sigma.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "track_blobs_spots.h"

#define WIDTH 640
#define HEIGHT 512
#define PITCH_PX 30
#define BACKGROUND 10
#define READ_NOISE 2
#define PAIR_LIMIT 400
#define PICTURES 6
#define FAR_CHI2 18.4 /* one in ten thousand, of two axes */

struct pair {
	struct true_spot spots[2];
};

struct score {
	int count, far;    /* spots that are not flagged as merged */
	double normalised; /* sum of (error / sigma)^2 of one axis */
};

static struct true_spot draw(double x, double y, double diameter_px, double amplitude,
			     struct rng *rng)
{
	return (struct true_spot){
		.x_px = x,
		.y_px = y,
		.diameter_px = diameter_px,
		.axis_ratio = 1,
		.psf_px = 0.6 + 0.2 * rng_uniform(rng),
		.amplitude = amplitude * (1 + 0.3 * rng_uniform(rng)),
	};
}

static int draw_pairs(struct picture *picture, struct pair *pairs, double diameter_px,
		      double amplitude, struct rng *rng)
{
	int count = 0;

	for (int y = PITCH_PX; y < HEIGHT - PITCH_PX; y += PITCH_PX)
		for (int x = PITCH_PX; x < WIDTH - PITCH_PX; x += PITCH_PX, count++) {
			double angle = 2 * M_PI * rng_uniform(rng);
			double apart_px = 2 + 3 * rng_uniform(rng);
			double x_px = x + rng_uniform(rng), y_px = y + rng_uniform(rng);
			struct true_spot *spots = pairs[count].spots;

			spots[0] = draw(x_px, y_px, diameter_px, amplitude, rng);
			spots[1] = draw(x_px + apart_px * cos(angle), y_px + apart_px * sin(angle),
					diameter_px, amplitude, rng);
			picture_add(picture, &spots[0], READ_NOISE);
			picture_add(picture, &spots[1], READ_NOISE);
		}
	return count;
}

static void score_spot(struct score *score, const struct blob *blob, const struct true_spot *spot)
{
	double sigma_px = (double)blob->sigma_px;
	double dx = ((double)blob->x_px - spot->x_px) / sigma_px;
	double dy = ((double)blob->y_px - spot->y_px) / sigma_px;

	if (blob->flags & BLOB_MERGED)
		return;
	score->count++;
	score->normalised += (dx * dx + dy * dy) / 2;
	score->far += dx * dx + dy * dy > FAR_CHI2;
}

/* Pairs of which two spots were found. */
static void score_pair(struct score *score, const struct blob_set *set, const struct pair *pair)
{
	const struct blob *blobs[2];

	for (int k = 0; k < 2; k++)
		blobs[k] = blob_near(set, pair->spots[k].x_px, pair->spots[k].y_px);
	if (!blobs[0] || !blobs[1] || blobs[0] == blobs[1])
		return;
	for (int k = 0; k < 2; k++)
		score_spot(score, blobs[k], &pair->spots[k]);
}

static struct score run_pairs(double diameter_px, double amplitude)
{
	struct blob_settings settings = blob_settings_default();
	struct pair pairs[PAIR_LIMIT];
	static struct blob_set set;
	struct blob_finder *finder;
	struct score score = {0};
	struct rng rng;

	rng_init(&rng, 17, 3);
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	for (int i = 0; i < PICTURES; i++) {
		struct picture picture = picture_create(WIDTH, HEIGHT, BACKGROUND);
		int count = draw_pairs(&picture, pairs, diameter_px, amplitude, &rng);
		struct grey_image image = picture_image(&picture);

		picture_expose(&picture, READ_NOISE, &rng);
		blob_finder_run(finder, &image, &set);
		for (int p = 0; p < count; p++)
			score_pair(&score, &set, &pairs[p]);
		picture_destroy(&picture);
	}
	blob_finder_destroy(finder);
	return score;
}

static void a_neighbour_a_pixel_away_is_in_the_sigma(void **state)
{
	static const double diameters_px[] = {1.2, 2.2}, amplitudes[] = {20, 30, 60};

	(void)state;
	for (int d = 0; d < 2; d++)
		for (int a = 0; a < 3; a++) {
			struct score score = run_pairs(diameters_px[d], amplitudes[a]);

			assert_true(score.count > 500);
			assert_true(score.normalised < 1.3 * score.count);
			assert_true(score.normalised > 0.5 * score.count);
			assert_true(score.far <= score.count / 100);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_neighbour_a_pixel_away_is_in_the_sigma),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
