/*
 * A stage whose spots get no names is told apart from an empty one, and from a good one.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "sim/play.h"
#include "track/naming_check.h"

static struct sim_play play;
static struct naming_check check;

static void begin(const char *scene, uint64_t seed, uint32_t camera_count)
{
	const struct sim_options options = {
		.scene = scene, .seed = seed, .camera_count = camera_count};

	memset(&check, 0, sizeof(check));
	assert_int_equal(sim_play_init(&play, &options, NULL), 0);
}

static void swap_first_two_views(void)
{
	const struct view *first = play.tracker_rig.views[0];

	play.tracker_rig.views[0] = play.tracker_rig.views[1];
	play.tracker_rig.views[1] = first;
}

/* The most blocks in a row that were not fine. */
static uint32_t play_seconds(double seconds)
{
	const struct blob_play blobs = {0};
	uint64_t shots = (uint64_t)(seconds * 1e9 / (double)sim_scene_period_ns(play.scene));
	uint32_t most = 0;

	for (uint64_t n = 0; n < shots; n++) {
		sim_play_shot_us(&play, &blobs, n, 0);
		struct shot shot = {.number = n,
				    .mid_exposure_ns = sim_scene_mid_exposure_ns(play.scene, n),
				    .camera_count = play.rig.camera_count};
		for (uint32_t c = 0; c < shot.camera_count; c++)
			shot.sets[c] = play.set.missing_mask >> c & 1 ? NULL : &play.sets[c];
		if (naming_check_run(&check, &play.tracker_rig, &shot, &play.set) &&
		    check.blocks_in_a_row > most)
			most = check.blocks_in_a_row;
	}
	return most;
}

static void swapped_cameras_are_told_by_points_that_do_not_meet(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 2; seed++) {
		begin("talking", seed, 4);
		swap_first_two_views();
		play_seconds(1.1);
		assert_int_equal(check.naming, NAMING_NO_POINTS);
		assert_int_equal(check.blocks_in_a_row, 4);
		assert_non_null(strstr(naming_remedy(check.naming), "swapped"));
		sim_play_finish(&play);
	}
}

/* Of as many markers, that are nowhere near one another as these. */
static void another_actors_layout_is_told_by_points_without_names(void **state)
{
	static struct layout layout;

	(void)state;
	begin("talking", 3, 6);
	layout = *play.tracker_rig.layout;
	for (uint32_t m = 0; m < layout.marker_count; m++)
		layout.markers[m].neutral_m =
			(struct vec3){0.01 * (double)(m * 37 % 23), 0.013 * (double)(m * 53 % 17),
				      0.011 * (double)(m * 29 % 19)};
	play.tracker_rig.layout = &layout;
	tracker_state_init(&play.state, &layout);
	play_seconds(1.1);
	assert_int_equal(check.naming, NAMING_NO_NAMES);
	assert_non_null(strstr(naming_remedy(check.naming), "layout"));
	sim_play_finish(&play);
}

static void stages_that_name_their_markers_are_fine(void **state)
{
	static const char *const scenes[] = {"talking", "turning", "sparse"};

	(void)state;
	for (size_t i = 0; i < sizeof(scenes) / sizeof(*scenes); i++) {
		begin(scenes[i], 7, 0);
		assert_true(play_seconds(1.6) < 3);
		assert_int_equal(check.naming, NAMING_FINE);
		assert_null(naming_remedy(check.naming));
		sim_play_finish(&play);
	}
}

/* One whose cameras see less than a quarter of the markers. */
static void a_nearly_empty_stage_tells_nothing(void **state)
{
	struct naming_check empty = {0};
	struct marker_set set = {.label_count = 74, .marker_count = 74};
	static struct blob_set spots = {.blob_count = 17};
	static struct layout layout = {.marker_count = 74};
	static struct view view;
	struct tracker_rig rig = {.camera_count = 1, .views = {&view}, .layout = &layout};
	struct shot shot = {.camera_count = 1, .sets = {&spots}};

	(void)state;
	for (int n = 0; n < 100; n++) {
		shot.mid_exposure_ns += 10000000;
		naming_check_run(&empty, &rig, &shot, &set);
	}
	assert_int_equal(empty.naming, NAMING_FINE);
	assert_true(empty.means.spots == 17);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(swapped_cameras_are_told_by_points_that_do_not_meet),
		cmocka_unit_test(another_actors_layout_is_told_by_points_without_names),
		cmocka_unit_test(stages_that_name_their_markers_are_fine),
		cmocka_unit_test(a_nearly_empty_stage_tells_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
