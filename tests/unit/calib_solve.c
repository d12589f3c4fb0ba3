/*
 * A waved board gives the rig back; what cannot be calibrated is refused with its remedy.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "calib_wave.h"

#define SMALL_WAVE                                                                             \
	((struct wave){                                                                        \
		.ir_count = 4,                                                                 \
		.pose_count = 30,                                                              \
		.board = {.squares_x = 9, .squares_y = 7, .square_m = 0.045, .tag_part = 0.7}, \
		.noise_px = 0.1,                                                               \
		.seed = 5})

static struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;

/* Seeds and solves; every failure is the caller's to expect. */
static int calibrate(struct solution *solution, const struct observations *observations,
		     struct diag *diag)
{
	struct seed seed;
	int err = seed_make(&seed, observations, diag);

	if (err)
		return err;
	err = solve(solution, observations, &seed, &settings, diag);
	seed_finish(&seed);
	return err;
}

static void refused_with(const struct observations *observations, const char *words)
{
	struct solution solution = {0};
	struct diag diag = {0};

	assert_int_equal(calibrate(&solution, observations, &diag), -EINVAL);
	assert_non_null(diag.text);
	if (!strstr(diag.text, words))
		fail_msg("not \"%s\" but %s", words, diag.text);
	diag_finish(&diag);
}

static void a_waved_board_gives_the_rig_back(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct solution solution = {0};
	struct diag diag = {0};

	wave.hd_count = 1;
	wave.lost_part = 0.1;
	wave.board.warp_x_m = 0.0008;
	wave.board.warp_y_m = -0.0005;
	wave_make(&waved, &wave);
	assert_int_equal(calibrate(&solution, &waved.observations, &diag), 0);
	struct wave_errors errors = wave_judge(&waved, &solution);
	assert_true(errors.camera_worst_mm < 1);
	assert_true(errors.volume_px < 0.05);
	assert_true(errors.triangulate_mm < 0.05);
	assert_float_equal(solution.sigma_px, 0.1, 0.004);
	assert_float_equal(solution.warp_m[0], 0.0008, 1e-4);
	assert_float_equal(solution.warp_m[1], -0.0005, 1e-4);
	solution_finish(&solution);
	wave_finish(&waved);
}

static void other_lens_models_are_solved_for(void **state)
{
	(void)state;
	static const char *const LENSES[] = {
		"LENSMODEL_OPENCV5",
		"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=6_fov_x_deg=50"};
	struct wave wave = SMALL_WAVE;
	struct waved waved;

	wave.pose_count = 40;
	wave_make(&waved, &wave);
	for (int i = 0; i < 2; i++) {
		struct solution solution = {0};
		struct diag diag = {0};

		settings.lens = LENSES[i];
		assert_int_equal(calibrate(&solution, &waved.observations, &diag), 0);
		assert_string_equal(solution.lens, LENSES[i]);
		assert_float_equal(solution.sigma_px, 0.1, 0.01);
		assert_true(wave_judge(&waved, &solution).volume_px < 0.05);
		solution_finish(&solution);
	}
	settings = SOLVE_SETTINGS_DEFAULT;
	wave_finish(&waved);
}

static void lenses_that_cannot_serve_are_refused(void **state)
{
	(void)state;
	static const char *const LENSES[] = {"LENSMODEL_CAHVORE_linearity=0.5", "LENSMODEL_CAHVORE",
					     "OPENCV8", ""};
	struct wave wave = SMALL_WAVE;
	struct waved waved;

	wave_make(&waved, &wave);
	for (int i = 0; i < 4; i++) {
		settings.lens = LENSES[i];
		refused_with(&waved.observations,
			     "not a lens model that mrcal knows and can solve");
	}
	settings = SOLVE_SETTINGS_DEFAULT;
	wave_finish(&waved);
}

static void the_same_views_in_any_order_give_the_same_bytes(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct observations backwards;
	struct solution one = {0}, other = {0};
	char hash[2][OBSERVATIONS_HASH_BYTES];

	wave_make(&waved, &wave);
	const struct observations *o = &waved.observations;
	assert_int_equal(
		observations_init(&backwards, &o->board, o->cameras, o->camera_count, NULL), 0);
	for (uint32_t v = o->view_count; v-- > 0;)
		assert_int_equal(observations_add(&backwards, o->views[v].camera, o->views[v].pose,
						  observations_px(o, v)),
				 0);
	observations_hash(o, hash[0]);
	observations_hash(&backwards, hash[1]);
	assert_string_equal(hash[0], hash[1]);
	assert_int_equal(calibrate(&one, o, NULL), 0);
	assert_int_equal(calibrate(&other, &backwards, NULL), 0);
	assert_memory_equal(one.intrinsics, other.intrinsics,
			    one.camera_count * one.lens_count * sizeof(double));
	assert_memory_equal(one.rt_cam_ref, other.rt_cam_ref,
			    one.camera_count * sizeof(*one.rt_cam_ref));
	backwards.px[3][0] += 1e-9;
	observations_hash(&backwards, hash[1]);
	assert_string_not_equal(hash[0], hash[1]);
	solution_finish(&one);
	solution_finish(&other);
	observations_finish(&backwards);
	wave_finish(&waved);
}

static void corners_far_off_are_left_out(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct solution solution = {0};
	uint32_t spoilt = 0;

	wave_make(&waved, &wave);
	struct observations *o = &waved.observations;
	for (uint32_t i = 0; i < o->view_count * o->corner_count; i += 101)
		if (!isnan(o->px[i][0])) {
			o->px[i][0] += 3;
			spoilt++;
		}
	assert_int_equal(calibrate(&solution, o, NULL), 0);
	assert_in_range(solution.outlier_count, spoilt, spoilt + spoilt / 10 + 3);
	assert_float_equal(solution.sigma_px, 0.1, 0.005);
	solution_finish(&solution);
	wave_finish(&waved);
}

/* A camera that saved one picture under another's number: that view says the board is elsewhere. */
static void views_that_contradict_the_others_are_refused(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct seed seed;

	wave.board.squares_x = 7;
	wave_make(&waved, &wave);
	struct observations *o = &waved.observations;
	uint32_t from = 0, to = 0;
	for (uint32_t v = 0; v < o->view_count; v++)
		if (o->views[v].camera == 1) {
			from = to;
			to = v;
		}
	memcpy(o->px + to * o->corner_count, observations_px(o, from),
	       o->corner_count * sizeof(*o->px));
	assert_int_equal(seed_make(&seed, o, NULL), 0);
	assert_int_equal(seed.refused, 1);
	assert_false(seed.good_view[to]);
	seed_finish(&seed);
	wave_finish(&waved);
}

static bool few_of_camera_2(const struct observed_view *view, uint32_t nth, const void *user)
{
	(void)user;
	return view->camera != 2 || nth < 5;
}

static void too_few_views_are_named(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct observations part;

	wave_make(&waved, &wave);
	assert_int_equal(observations_select(&part, &waved.observations, few_of_camera_2, NULL), 0);
	refused_with(&part, "camera ir2: ");
	refused_with(&part, "usable views of the board");
	observations_finish(&part);
	wave_finish(&waved);
}

/* Even poses for camera 3, odd ones for all others: they never meet. */
static bool apart(const struct observed_view *view, uint32_t nth, const void *user)
{
	(void)user;
	return (view->camera == 3) == (nth % 2 == 0);
}

static void a_camera_without_a_link_is_named(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct observations part;

	wave.pose_count = 50;
	wave_make(&waved, &wave);
	assert_int_equal(observations_select(&part, &waved.observations, apart, NULL), 0);
	refused_with(&part, "camera ir3: no link to camera ir0");
	observations_finish(&part);
	wave_finish(&waved);
}

static void one_camera_under_two_names_is_found(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;

	wave_make(&waved, &wave);
	struct observations *o = &waved.observations;
	for (uint32_t v = 1; v < o->view_count; v++)
		if (o->views[v].camera == 1 && o->views[v - 1].camera == 0)
			memcpy(o->px + v * o->corner_count, observations_px(o, v - 1),
			       o->corner_count * sizeof(*o->px));
		else if (o->views[v].camera == 1)
			o->views[v].seen_count = 0;
	refused_with(o, "cameras ir0 and ir1: all their corners are in the same places");
	wave_finish(&waved);
}

/* The print is 3 % higher than it should be. */
static void a_stretched_print_is_named(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;

	wave.stretch = 1.03;
	wave_make(&waved, &wave);
	refused_with(&waved.observations, "times as high as wide");
	wave_finish(&waved);
}

static void random_corners_are_refused_in_time(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct solution solution = {0};
	struct rng rng;
	int64_t start_ns = clock_now_ns();

	wave_make(&waved, &wave);
	rng_init(&rng, 1, 1);
	for (uint32_t i = 0; i < waved.observations.view_count * waved.observations.corner_count;
	     i++) {
		waved.observations.px[i][0] = 1000 * rng_uniform(&rng);
		waved.observations.px[i][1] = 1000 * rng_uniform(&rng);
	}
	assert_true(calibrate(&solution, &waved.observations, NULL) < 0);
	assert_true(clock_now_ns() - start_ns < 20 * NS_PER_S);
	wave_finish(&waved);
}

static void a_solve_that_takes_too_long_is_given_up(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	struct solution solution = {0};
	struct diag diag = {0};

	wave_make(&waved, &wave);
	settings.seconds_max = 0.01;
	assert_int_equal(calibrate(&solution, &waved.observations, &diag), -ETIMEDOUT);
	assert_non_null(strstr(diag.text, "no end within 0.01 s"));
	settings = SOLVE_SETTINGS_DEFAULT;
	diag_finish(&diag);
	wave_finish(&waved);
}

static void bad_views_are_not_taken(void **state)
{
	(void)state;
	struct wave wave = SMALL_WAVE;
	struct waved waved;
	double px[BOARD_CORNER_MAX][2];

	wave_make(&waved, &wave);
	struct observations *o = &waved.observations;
	const struct observed_view *view = &o->views[0];
	for (uint32_t i = 0; i < o->corner_count; i++)
		px[i][0] = px[i][1] = 10 + i;
	assert_int_equal(observations_add(o, view->camera, view->pose, (const double(*)[2])px),
			 -EEXIST);
	px[3][0] = 1280; /* the last pixel's centre is at 1279 */
	assert_int_equal(observations_add(o, 0, 1000, (const double(*)[2])px), -ERANGE);
	wave_finish(&waved);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_waved_board_gives_the_rig_back),
		cmocka_unit_test(other_lens_models_are_solved_for),
		cmocka_unit_test(lenses_that_cannot_serve_are_refused),
		cmocka_unit_test(the_same_views_in_any_order_give_the_same_bytes),
		cmocka_unit_test(corners_far_off_are_left_out),
		cmocka_unit_test(views_that_contradict_the_others_are_refused),
		cmocka_unit_test(too_few_views_are_named),
		cmocka_unit_test(a_camera_without_a_link_is_named),
		cmocka_unit_test(one_camera_under_two_names_is_found),
		cmocka_unit_test(a_stretched_print_is_named),
		cmocka_unit_test(random_corners_are_refused_in_time),
		cmocka_unit_test(a_solve_that_takes_too_long_is_given_up),
		cmocka_unit_test(bad_views_are_not_taken),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
