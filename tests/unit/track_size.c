/*
 * Size classes: a light that is surely twice as large as a marker, or half as large, is not that
 * marker, even where it is expected.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "sim/play.h"
#include "tests/unit/label_named.h"
#include "track/match/point_size.h"

#define RATE_HZ 120
#define LEARNING 120 /* shots in which the cameras' blur is learned */

static const struct blob_play CLEAN = {.sigma_px = 0.03};
static struct sim_play play;

static void begin(const char *scene)
{
	struct sim_options options = {.scene = scene, .seed = 5, .rate_hz = RATE_HZ};

	memset(&play, 0, sizeof(play));
	assert_int_equal(sim_play_init(&play, &options, NULL), 0);
	for (uint64_t n = 0; n < LEARNING; n++)
		sim_play_shot_us(&play, &CLEAN, n, 0);
}

/* The marker's spots spread as if its diameter were `times` as large. */
static void swell(uint32_t c, uint32_t label, double times)
{
	const struct view *view = play.tracker_rig.views[c];
	struct vec3 p = play.truth.markers[label].p_stage_m;
	double diameter_m = sim_scene_layout(play.scene)->markers[label].diameter_m;
	double pixel[2], slopes[2][3], own_px2 = 0;

	if (!view_project(view, p, pixel, slopes))
		return;
	for (int k = 0; k < 3; k++)
		own_px2 += 0.5 * (slopes[0][k] * slopes[0][k] + slopes[1][k] * slopes[1][k]);
	own_px2 *= diameter_m * diameter_m / 16;
	for (uint32_t b = 0; b < play.sets[c].blob_count; b++) {
		struct blob *blob = &play.sets[c].blobs[b];

		if (hypot(blob->x_px - pixel[0], blob->y_px - pixel[1]) > 1)
			continue;
		blob->shape_px2[0] += (float)((times * times - 1) * own_px2);
		blob->shape_px2[2] += (float)((times * times - 1) * own_px2);
	}
}

/* One more shot, in which this marker seems so many times as large. */
static enum marker_status status_of_swollen(uint64_t n, uint32_t label, double times)
{
	struct shot shot = {.number = n,
			    .mid_exposure_ns = sim_scene_mid_exposure_ns(play.scene, n),
			    .camera_count = play.tracker_rig.camera_count};

	sim_scene_truth(play.scene, (double)shot.mid_exposure_ns / NS_PER_S, &play.truth);
	for (uint32_t c = 0; c < shot.camera_count; c++) {
		blob_play_camera(&CLEAN, play.scene, &play.truth, n, c, &play.sets[c]);
		swell(c, label, times);
		shot.sets[c] = &play.sets[c];
	}
	tracker_run(&play.state, play.scratch, &play.tracker_rig, &shot, &play.set);
	return play.set.markers[label].status;
}

static void layout_with_one_diameter_for_all_asks_no_size(void **state)
{
	(void)state;
	begin("rest");
	play.state.blur = (struct view_blur){0};
	play.state.diameter_min_m = play.state.diameter_max_m;
	for (uint64_t n = LEARNING; n < 2 * LEARNING; n++)
		sim_play_shot_us(&play, &CLEAN, n, 0);
	assert_int_equal(status_of_swollen(2 * LEARNING, label_named(&play, "cheek_l_3"), 4),
			 MARKER_MEASURED);
	sim_play_finish(&play);
}

/* A shot as it is, one in which the marker seems so many times as large, and one as it is. */
static void check_not_taken(const char *name, double times)
{
	uint32_t label = label_named(&play, name);

	assert_int_equal(status_of_swollen(LEARNING, label, 1), MARKER_MEASURED);
	assert_int_equal(status_of_swollen(LEARNING + 1, label, times), MARKER_PREDICTED);
	assert_int_equal(status_of_swollen(LEARNING + 2, label, 1), MARKER_MEASURED);
}

static void light_of_another_size_is_not_the_marker(void **state)
{
	(void)state;
	begin("rest");
	check_not_taken("cheek_l_3", 4);
	uint32_t cheek = label_named(&play, "cheek_l_3");

	assert_int_equal(status_of_swollen(LEARNING + 3, cheek, 1.5), MARKER_MEASURED);
	assert_int_equal(status_of_swollen(LEARNING + 4, cheek, 4), MARKER_PREDICTED);
	assert_int_equal(play.set.marker_count, play.set.label_count + 1); /* it has no name */
	sim_play_finish(&play);
}

/* Shoulders wear 9 mm and more, faces 3. */
static void faces_take_no_marker_as_large_as_a_body_s(void **state)
{
	(void)state;
	begin("11-body-and-face");
	check_not_taken("cheek_l_3", 4);
	sim_play_finish(&play);
}

static void named_markers_teach_what_the_lenses_add(void **state)
{
	(void)state;
	begin("rest");
	for (uint32_t c = 0; c < play.tracker_rig.camera_count; c++)
		if (play.tracker_rig.views[c])
			assert_true(play.state.blur.px2[c] > 0.1 && play.state.blur.px2[c] < 3);
	sim_play_finish(&play);
}

static void sizes_that_are_not_sure_exclude_nothing(void **state)
{
	const struct point_size unknown = {0}, unsure = {36e-6, 12e-6}, sure = {36e-6, 4e-6};

	(void)state;
	assert_true(point_size_fits(&unknown, 0.0015));
	assert_true(point_size_fits(&unsure, 0.0015));
	assert_false(point_size_fits(&sure, 0.0015));
	assert_true(point_size_is_larger(&sure, 0.0015));
	assert_true(point_size_fits(&sure, 0.004));
	assert_true(point_size_is_smaller(&sure, 0.014));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(layout_with_one_diameter_for_all_asks_no_size),
		cmocka_unit_test(light_of_another_size_is_not_the_marker),
		cmocka_unit_test(faces_take_no_marker_as_large_as_a_body_s),
		cmocka_unit_test(named_markers_teach_what_the_lenses_add),
		cmocka_unit_test(sizes_that_are_not_sure_exclude_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
