/*
 * What a calibration says of its own errors is what they are.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "calib/board/coverage.h"
#include "calib/board/where_next.h"
#include "calib/solve/cross_check.h"
#include "calib/solve/uncertainty.h"
#include "calib_wave.h"

#define SMALL_WAVE                                                                             \
	((struct wave){                                                                        \
		.ir_count = 4,                                                                 \
		.pose_count = 24,                                                              \
		.board = {.squares_x = 7, .squares_y = 6, .square_m = 0.055, .tag_part = 0.7}, \
		.noise_px = 0.1,                                                               \
		.seed = 5})
#define RIGS 15
#define REPEATS 15

static double norm2(struct vec3 v)
{
	return vec3_dot(v, v);
}

static void two_thirds_of_the_errors_are_within_one_sigma(void **state)
{
	(void)state;
	static struct volume volume;
	static struct uncertainty uncertainty;
	static struct vec3 off_m[VOLUME_POINT_MAX];
	int within = 0, all = 0;

	for (uint64_t rig = 1; rig <= RIGS; rig++) {
		struct wave wave = SMALL_WAVE;
		struct solution solution;
		struct waved waved;
		struct seed seed;

		wave.seed = rig;
		wave_make(&waved, &wave);
		assert_int_equal(wave_solve(&waved, &solution, &seed), 0);
		wave_volume(&waved, &solution, &volume, off_m);
		assert_int_equal(
			uncertainty_find(&uncertainty, &solution, &waved.observations, &volume), 0);
		for (uint32_t i = 0; i < volume.count; i++) {
			const double *off = &off_m[i].x;

			for (int axis = 0; axis < 3; axis++, all++)
				within += off[axis] * off[axis] < uncertainty.cov_m2[i][axis][axis];
		}
		seed_finish(&seed);
		solution_finish(&solution);
		wave_finish(&waved);
	}
	print_message("# one_sigma_coverage %.3f\n", (double)within / all);
	assert_true(within > 0.56 * all && within < 0.80 * all); /* 0.683, of few rigs */
}

/* The same rig again and again with fresh noise on the corners. */
static void the_prediction_is_what_solving_again_scatters(void **state)
{
	(void)state;
	static struct volume volume;
	static struct uncertainty uncertainty;
	static struct vec3 off_m[VOLUME_POINT_MAX];
	struct wave wave = SMALL_WAVE;
	double predicted = 0, found = 0;

	for (int repeat = 0; repeat < REPEATS; repeat++) {
		struct solution solution;
		struct waved waved;
		struct seed seed;

		wave.noise_seed = (uint64_t)repeat + 1;
		wave_make(&waved, &wave);
		assert_int_equal(wave_solve(&waved, &solution, &seed), 0);
		wave_volume(&waved, &solution, &volume, off_m);
		assert_int_equal(
			uncertainty_find(&uncertainty, &solution, &waved.observations, &volume), 0);
		predicted += pow(uncertainty.rms_m, 2);
		for (uint32_t i = 0; i < volume.count; i++)
			found += norm2(off_m[i]) / volume.count;
		seed_finish(&seed);
		solution_finish(&solution);
		wave_finish(&waved);
	}
	print_message("# found over predicted, rms: %.3f\n", sqrt(found / predicted));
	assert_true(found > 0.7 * predicted && found < 1.4 * predicted);
}

static void halves_agree_about_as_well_as_predicted(void **state)
{
	(void)state;
	static struct volume volume;
	static struct uncertainty uncertainty;
	const struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;
	struct wave wave = SMALL_WAVE;
	struct cross_check check;
	struct solution solution;
	struct waved waved;
	struct seed seed;

	wave.pose_count = 60;
	wave_make(&waved, &wave);
	assert_int_equal(wave_solve(&waved, &solution, &seed), 0);
	assert_int_equal(volume_of_poses(&volume, &solution, &waved.observations), 0);
	assert_int_equal(uncertainty_find(&uncertainty, &solution, &waved.observations, &volume),
			 0);
	assert_int_equal(cross_check(&check, &waved.observations, &seed, &solution, &volume,
				     &settings, NULL),
			 0);
	assert_true(check.held_out_rms_px > solution.rms_px * 0.98);
	assert_true(check.held_out_rms_px < solution.rms_px * 1.1);
	/* each half has sqrt 2 of the whole's error, their difference sqrt 2 of that */
	assert_true(check.halves_differ_m < 2 * 2 * uncertainty.rms_m);
	assert_true(check.halves_differ_m > 2 * 0.4 * uncertainty.rms_m);
	seed_finish(&seed);
	solution_finish(&solution);
	wave_finish(&waved);
}

/* Words and pixels say the same of the place, and the pixels are those of the cameras' truth. */
static void the_worst_place_is_told_by_where_cameras_see_it(void **state)
{
	static struct uncertainty uncertainty;
	static struct volume volume;
	const struct pose identity = POSE_IDENTITY;
	struct wave wave = SMALL_WAVE;
	struct solution solution;
	struct waved waved;
	struct seed seed;
	char words[WHERE_WORDS_BYTES];

	(void)state;
	wave_make(&waved, &wave);
	assert_int_equal(wave_solve(&waved, &solution, &seed), 0);
	assert_int_equal(volume_of_poses(&volume, &solution, &waved.observations), 0);
	assert_int_equal(uncertainty_find(&uncertainty, &solution, &waved.observations, &volume),
			 0);
	struct where_next where =
		where_next(&uncertainty, &volume, &solution, &waved.observations, &identity);
	assert_int_equal(where.camera_count, WHERE_CAMERAS);
	assert_float_equal(where.sigma_m, uncertainty.worst_m, 0);
	for (uint32_t i = 0; i < WHERE_CAMERAS; i++) {
		double px[2];
		uint32_t camera = where.cameras[i].camera;

		assert_true(solution_project(&solution, camera, where.p_stage_m, px));
		assert_float_equal(px[0], where.cameras[i].px[0], 1e-9);
		where_next_words(&where, &waved.observations, words);
		assert_non_null(strstr(words, waved.observations.cameras[camera].name));
		assert_non_null(strstr(
			words, coverage_region_name(&waved.observations.cameras[camera], px)));
	}
	seed_finish(&seed);
	solution_finish(&solution);
	wave_finish(&waved);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_worst_place_is_told_by_where_cameras_see_it),
		cmocka_unit_test(two_thirds_of_the_errors_are_within_one_sigma),
		cmocka_unit_test(the_prediction_is_what_solving_again_scatters),
		cmocka_unit_test(halves_agree_about_as_well_as_predicted),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
