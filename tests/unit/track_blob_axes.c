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

#include "track/blobs/blob_axes.h"
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

static void the_long_axis_tells_the_diameter_whatever_the_brightness(void **state)
{
	static const double diameters_px[] = {2, 3, 5, 8, 12};
	static struct true_spot spots[256];
	struct rng rng;

	(void)state;
	rng_init(&rng, 1, 1);
	for (int d = 0; d < 5; d++) {
		const struct true_spot like = {0, 0, diameters_px[d], 0.7, 0, BLUR_PX, 0};
		double spread_px2 = diameters_px[d] * diameters_px[d] / 16 + BLUR_PX2;
		int count = grid(spots, &like, &rng);
		double sum = 0, squares = 0;

		find(spots, count, (uint64_t)d);
		assert_int_equal(set.blob_count, count);
		for (uint32_t b = 0; b < set.blob_count; b++) {
			struct blob_axes axes;

			assert_true(blob_axes(&set.blobs[b], &axes));
			sum += 4 * sqrt(fmax(axes.major_px2 - BLUR_PX2, 0));
			squares += pow((axes.major_px2 - spread_px2) / axes.sigma_px2, 2);
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

/* Of the pairs that the finder did not part. */
static void two_in_one_spot_are_longer_by_their_distance(void **state)
{
	static const double distances_px[] = {1.5, 2, 2.5};
	static struct true_spot spots[512];

	(void)state;
	for (int d = 0; d < 3; d++) {
		const double part_px2 = 2.5 * 2.5 / 16 + BLUR_PX2;
		double longer_px2 = distances_px[d] * distances_px[d] / 4, sum = 0, turn = 0;
		int merged = 0, count;
		struct rng rng;

		rng_init(&rng, 3, 3);
		count = place_pairs(spots, distances_px[d], 2.5, &rng);
		find(spots, count, 5);
		for (int i = 0; i < count; i += 2) {
			double x = (spots[i].x_px + spots[i + 1].x_px) / 2;
			double y = (spots[i].y_px + spots[i + 1].y_px) / 2;
			const struct blob *blob = blob_near(&set, x, y);
			struct blob_axes axes;

			if (!blob || hypot((double)blob->x_px - x, (double)blob->y_px - y) > 0.5)
				continue;
			assert_true(blob_axes(blob, &axes));
			merged++;
			sum += axes.major_px2 - part_px2;
			turn += fabs(
				remainder(axes.angle_rad - atan2(spots[i + 1].y_px - spots[i].y_px,
								 spots[i + 1].x_px - spots[i].x_px),
					  M_PI));
		}
		print_message("# %g px apart: %d merged, longer by %.2f of %.2f px2, %.1f degrees "
			      "off\n",
			      distances_px[d], merged, sum / merged, longer_px2,
			      turn / merged * 180 / M_PI);
		assert_true(merged > 50);
		assert_true(fabs(sum / merged / longer_px2 - 1) < 0.3);
		assert_true(turn / merged < 0.2);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_long_axis_tells_the_diameter_whatever_the_brightness),
		cmocka_unit_test(two_in_one_spot_are_longer_by_their_distance),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
