/*
 * What a blob's spread says, on blobs found in drawn pictures.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "track/blob_size.h"
#include "track_blobs_spots.h"

#define WIDTH 640
#define HEIGHT 512
#define PITCH_PX 40
#define BLUR_PX 0.8
#define BLUR_PX2 (BLUR_PX * BLUR_PX + 1 / 12.0)

static struct blob_set set;

static void find(const struct true_spot *spots, int count, uint64_t seed)
{
	struct picture picture = picture_create(WIDTH, HEIGHT, 10);
	struct grey_image image = picture_image(&picture);
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;
	struct rng rng;

	rng_init(&rng, seed, 1);
	for (int i = 0; i < count; i++)
		picture_add(&picture, &spots[i], 2);
	picture_expose(&picture, 2, &rng);
	assert_int_equal(blob_finder_create(&finder, WIDTH, HEIGHT, &settings), 0);
	blob_finder_run(finder, &image, &set);
	blob_finder_destroy(finder);
	picture_destroy(&picture);
}

static int grid(struct true_spot *spots, const struct true_spot *like, struct rng *rng)
{
	int count = 0;

	for (int y = 30; y < HEIGHT - 30; y += PITCH_PX)
		for (int x = 30; x < WIDTH - 30; x += PITCH_PX) {
			spots[count] = *like;
			spots[count].x_px = x + 4 * rng_uniform(rng);
			spots[count].y_px = y + 4 * rng_uniform(rng);
			spots[count].angle_rad = M_PI * rng_uniform(rng);
			spots[count++].amplitude = 60 + 160 * rng_uniform(rng);
		}
	return count;
}

static void the_diameter_comes_out_whatever_the_brightness(void **state)
{
	static const double diameters_px[] = {2, 3, 5, 8, 12};
	static struct true_spot spots[256];
	struct rng rng;

	(void)state;
	rng_init(&rng, 1, 1);
	for (int d = 0; d < 5; d++) {
		const struct true_spot like = {0, 0, diameters_px[d], 0.7, 0, BLUR_PX, 0};
		int count = grid(spots, &like, &rng);
		double sum = 0, squares = 0;

		find(spots, count, (uint64_t)d);
		assert_int_equal(set.blob_count, count);
		for (uint32_t b = 0; b < set.blob_count; b++) {
			struct blob_diameter found;

			assert_true(blob_estimate_diameter(&set.blobs[b], 1e-3, BLUR_PX2, &found));
			sum += found.diameter_m * 1e3;
			squares += pow((found.diameter_m * 1e3 - diameters_px[d]) /
					       (found.sigma_m * 1e3),
				       2);
		}
		print_message("# %g px: %.2f px, (error / sigma)^2 %.2f\n", diameters_px[d],
			      sum / count, squares / count);
		assert_true(fabs(sum / count / diameters_px[d] - 1) < 0.15);
		assert_true(squares / count < 2);
	}
}

/* Pairs of equal spots, one behind the other; their place, direction and brightness by chance. */
static int place_pairs(struct true_spot *spots, double distance_px, double diameter_px,
		       struct rng *rng)
{
	int count = 0;

	for (int y = 30; y < HEIGHT - 30; y += PITCH_PX)
		for (int x = 30; x < WIDTH - 30; x += PITCH_PX) {
			double angle = 2 * M_PI * rng_uniform(rng);
			double dx = distance_px / 2 * cos(angle), dy = distance_px / 2 * sin(angle);
			double middle_x = x + 4 * rng_uniform(rng);
			double middle_y = y + 4 * rng_uniform(rng);
			struct true_spot spot = {middle_x - dx,
						 middle_y - dy,
						 diameter_px,
						 1,
						 0,
						 BLUR_PX,
						 100 + 60 * rng_uniform(rng)};

			spots[count++] = spot;
			spot.x_px += 2 * dx;
			spot.y_px += 2 * dy;
			spots[count++] = spot;
		}
	return count;
}

/* Whoever parts them, the finder or blob_split_two(). False when neither does. */
static bool part_pair(const struct true_spot pair[2], double part_px2, struct blob parts[2])
{
	double x = (pair[0].x_px + pair[1].x_px) / 2, y = (pair[0].y_px + pair[1].y_px) / 2;
	const struct blob *blob = blob_near(&set, x, y);

	if (!blob)
		return false;
	if (hypot((double)blob->x_px - x, (double)blob->y_px - y) <= 0.5)
		return blob_split_two(blob, part_px2, parts);
	parts[0] = *blob_near(&set, pair[0].x_px, pair[0].y_px);
	parts[1] = *blob_near(&set, pair[1].x_px, pair[1].y_px);
	return true;
}

/* Per axis, to the nearer one of the pair. */
static double error_px2_of(const struct blob *part, const struct true_spot pair[2])
{
	double best = 1e9;

	for (int s = 0; s < 2; s++) {
		double ex = (double)part->x_px - pair[s].x_px;
		double ey = (double)part->y_px - pair[s].y_px;

		best = fmin(best, (ex * ex + ey * ey) / 2);
	}
	return best;
}

static void split_pairs(double distance_px, double diameter_px, double *error_px2,
			double *in_sigmas, int *split_count, int *pair_count)
{
	static struct true_spot spots[512];
	double part_px2 = diameter_px * diameter_px / 16 + BLUR_PX2;
	struct rng rng;

	rng_init(&rng, 3, 3);
	int count = place_pairs(spots, distance_px, diameter_px, &rng);

	find(spots, count, 5);
	*error_px2 = *in_sigmas = 0;
	*split_count = 0;
	*pair_count = count / 2;
	for (int i = 0; i < count; i += 2) {
		struct blob parts[2] = {0};

		if (!part_pair(&spots[i], part_px2, parts))
			continue;
		(*split_count)++;
		for (int p = 0; p < 2; p++) {
			double error = error_px2_of(&parts[p], &spots[i]);

			*error_px2 += error / 2;
			*in_sigmas += error / pow((double)parts[p].sigma_px, 2) / 2;
		}
	}
}

static void two_equal_markers_in_one_spot_are_found_apart(void **state)
{
	static const double distances_px[] = {1.5, 2, 2.5, 3};

	(void)state;
	for (int i = 0; i < 4; i++) {
		double error_px2, in_sigmas;
		int split, pairs;

		split_pairs(distances_px[i], 2.5, &error_px2, &in_sigmas, &split, &pairs);
		print_message(
			"# %g px apart: %d of %d split, rms %.3f px, (error / sigma)^2 %.2f\n",
			distances_px[i], split, pairs, sqrt(error_px2 / fmax(split, 1)),
			in_sigmas / fmax(split, 1));
		if (distances_px[i] >= 2) {
			assert_true(split > 0.9 * pairs);
			assert_true(sqrt(error_px2 / split) < 0.18);
		}
		assert_true(in_sigmas / fmax(split, 1) < 1.5);
	}
}

static void one_marker_is_not_two(void **state)
{
	static struct true_spot spots[256];
	const struct true_spot like = {0, 0, 3, 1, 0, BLUR_PX, 0};
	struct blob parts[2];
	struct rng rng;
	int split = 0;

	(void)state;
	rng_init(&rng, 1, 1);
	find(spots, grid(spots, &like, &rng), 9);
	for (uint32_t b = 0; b < set.blob_count; b++)
		split += blob_split_two(&set.blobs[b], 9 / 16.0 + BLUR_PX2, parts);
	assert_true(split < 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_diameter_comes_out_whatever_the_brightness),
		cmocka_unit_test(two_equal_markers_in_one_spot_are_found_apart),
		cmocka_unit_test(one_marker_is_not_two),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
