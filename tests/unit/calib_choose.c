/*
 * Which views a calibration is made from, what is said to be missing, and which rig is in force.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "calib/board/choose.h"
#include "calib/board/coverage.h"
#include "calib/rig/rig_store.h"
#include "calib_wave.h"

static const struct wave WAVE = {
	.ir_count = 4,
	.pose_count = 60,
	.board = {.squares_x = 11, .squares_y = 8, .square_m = 0.035, .tag_part = 0.7},
	.seed = 4};

static struct observations choose(const struct observations *all, uint32_t poses_max,
				  uint32_t *near_count)
{
	struct choose_settings settings = CHOOSE_SETTINGS_DEFAULT;
	struct observations chosen;

	settings.poses_max = poses_max;
	assert_int_equal(observations_choose(&chosen, all, &settings, near_count), 0);
	return chosen;
}

static bool is_any(const struct observed_view *view, uint32_t nth, const void *user)
{
	(void)view;
	(void)nth;
	(void)user;
	return true;
}

static void a_board_that_stood_still_is_one_pose(void **state)
{
	struct observations o, chosen;
	struct waved waved;
	uint32_t near;

	(void)state;
	wave_make(&waved, &WAVE);
	uint32_t poses = observations_pose_count(&waved.observations);
	assert_int_equal(observations_select(&o, &waved.observations, is_any, NULL), 0);
	for (uint32_t v = 0; v < o.view_count; v++) /* behind all poses: the same again */
		assert_int_equal(observations_add(&waved.observations, o.views[v].camera,
						  o.views[v].pose + 1000, observations_px(&o, v)),
				 0);
	chosen = choose(&waved.observations, 1000, &near);
	assert_int_equal(observations_pose_count(&chosen), poses);
	assert_int_equal(near, poses);
	observations_finish(&o);
	observations_finish(&chosen);
	wave_finish(&waved);
}

static void choosing_again_changes_nothing(void **state)
{
	char first[OBSERVATIONS_HASH_BYTES], second[OBSERVATIONS_HASH_BYTES];
	struct waved waved;
	uint32_t near;

	(void)state;
	wave_make(&waved, &WAVE);
	struct observations once = choose(&waved.observations, 20, &near);
	struct observations twice = choose(&once, 20, &near);
	assert_int_equal(observations_pose_count(&once), 20);
	observations_hash(&once, first);
	observations_hash(&twice, second);
	assert_string_equal(first, second);
	observations_finish(&once);
	observations_finish(&twice);
	wave_finish(&waved);
}

static bool is_on_the_left(const struct observed_view *view, uint32_t nth, const void *user)
{
	const struct observations *o = user;
	double sum = 0;
	int count = 0;

	(void)nth;
	for (uint32_t v = 0; v < o->view_count; v++)
		if (o->views[v].pose == view->pose && o->views[v].camera == view->camera)
			for (uint32_t i = 0; i < o->corner_count; i++)
				if (!isnan(observations_px(o, v)[i][0])) {
					sum += observations_px(o, v)[i][0];
					count++;
				}
	return sum / count < 0.4 * o->cameras[view->camera].width_px;
}

static void the_half_that_was_not_seen_is_missing(void **state)
{
	struct camera_coverage coverage[CAMERA_MAX];
	char words[COVERAGE_WORDS_BYTES];
	struct observations left;
	struct waved waved;

	(void)state;
	wave_make(&waved, &WAVE);
	assert_int_equal(observations_select(&left, &waved.observations, is_on_the_left,
					     &waved.observations),
			 0);
	assert_int_equal(coverage_find(coverage, &left), 0);
	coverage_missing(&coverage[0], false, words);
	assert_non_null(strstr(words, "upper right"));
	assert_null(strstr(words, ", left"));
	assert_false(coverage_enough(&coverage[0], false));
	assert_true(coverage_progress(&coverage[0], false) < 1);
	observations_finish(&left);
	wave_finish(&waved);
}

static void whoever_shows_it_all_has_shown_enough(void **state)
{
	struct camera_coverage coverage[CAMERA_MAX];
	struct wave wave = WAVE;
	struct waved waved;

	(void)state;
	wave.pose_count = 200;
	wave_make(&waved, &wave);
	assert_int_equal(coverage_find(coverage, &waved.observations), 0);
	for (uint32_t c = 0; c < wave.ir_count; c++) {
		assert_true(coverage_enough(&coverage[c], false));
		assert_float_equal(coverage_progress(&coverage[c], false), 1, 0);
	}
	coverage[0].linked = 0;
	assert_false(coverage_enough(&coverage[0], false));
	assert_true(coverage_enough(&coverage[0], true));
	wave_finish(&waved);
}

static void a_rig_comes_into_force_and_back(void **state)
{
	char dir[] = "/tmp/calib-store-XXXXXX", rig[64], path[PATH_MAX], command[128];
	uint32_t number, kept;
	struct stat st;

	(void)state;
	assert_non_null(mkdtemp(dir));
	snprintf(rig, sizeof(rig), "%s/rig", dir);
	assert_int_equal(mkdir(rig, 0777), 0);
	assert_int_equal(rig_store_path(path, rig, NULL, true, NULL), 0);
	assert_int_equal(rig_store_next(rig, &number, NULL), 0);
	assert_int_equal(number, 2); /* the first one is for what is there */
	assert_int_equal(rig_store_put_in_force(rig, number, &kept, NULL), -ENOENT);
	assert_int_equal(lstat(rig, &st), 0);
	assert_true(S_ISDIR(st.st_mode));
	assert_int_equal(rig_store_revision_path(path, rig, number, NULL), 0);
	assert_int_equal(mkdir(path, 0777), 0);
	assert_int_equal(rig_store_put_in_force(rig, number, &kept, NULL), 0);
	assert_int_equal(kept, 1);
	assert_int_equal(rig_store_in_force(rig), 2);
	assert_int_equal(rig_store_put_in_force(rig, 1, &kept, NULL), 0);
	assert_int_equal(rig_store_in_force(rig), 1);
	assert_int_equal(rig_store_next(rig, &number, NULL), 0);
	assert_int_equal(number, 3);
	snprintf(command, sizeof(command), "rm -r %s", dir);
	assert_int_equal(system(command), 0);
}

/* A new revision of `rig` is made and put into force, as far as the store lets it. */
static int calibrate(const char *rig)
{
	char path[PATH_MAX];
	uint32_t number, kept;
	int fd, err = rig_store_lock(&fd, rig, NULL);

	if (err)
		return err;
	assert_int_equal(rig_store_next(rig, &number, NULL), 0);
	assert_int_equal(rig_store_revision_path(path, rig, number, NULL), 0);
	assert_int_equal(mkdir(path, 0777), 0);
	err = rig_store_put_in_force(rig, number, &kept, NULL);
	rig_store_unlock(fd, rig);
	return err;
}

static void what_is_the_users_is_not_taken_for_a_rig(void **state)
{
	char dir[] = "/tmp/calib-store-XXXXXX", rig[64], other[64], target[PATH_MAX], command[128];
	struct stat st;

	(void)state;
	assert_non_null(mkdtemp(dir));
	snprintf(rig, sizeof(rig), "%s/layout.yaml", dir);
	FILE *file = fopen(rig, "w");
	assert_non_null(file);
	fclose(file);
	assert_int_equal(calibrate(rig), -EEXIST);
	assert_int_equal(lstat(rig, &st), 0);
	assert_true(S_ISREG(st.st_mode));

	snprintf(rig, sizeof(rig), "%s/rig", dir);
	assert_int_equal(symlink("srv/0001", rig), 0);
	assert_int_equal(rig_store_in_force(rig), 0);
	assert_int_equal(calibrate(rig), -EEXIST);
	assert_int_equal(readlink(rig, target, sizeof(target)), 8);

	snprintf(other, sizeof(other), "%s/own", dir);
	assert_int_equal(calibrate(other), 0);
	assert_int_equal(calibrate(other), 0);
	assert_int_equal(rig_store_in_force(other), 2);
	snprintf(command, sizeof(command), "rm -r %s", dir);
	assert_int_equal(system(command), 0);
}

static void a_calibration_of_which_nothing_came_leaves_no_store(void **state)
{
	char dir[] = "/tmp/calib-store-XXXXXX", rig[64];
	int fd;

	(void)state;
	assert_non_null(mkdtemp(dir));
	snprintf(rig, sizeof(rig), "%s/rig", dir);
	assert_int_equal(rig_store_lock(&fd, rig, NULL), 0);
	rig_store_unlock(fd, rig);
	assert_int_equal(rmdir(dir), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_board_that_stood_still_is_one_pose),
		cmocka_unit_test(choosing_again_changes_nothing),
		cmocka_unit_test(the_half_that_was_not_seen_is_missing),
		cmocka_unit_test(whoever_shows_it_all_has_shown_enough),
		cmocka_unit_test(a_rig_comes_into_force_and_back),
		cmocka_unit_test(what_is_the_users_is_not_taken_for_a_rig),
		cmocka_unit_test(a_calibration_of_which_nothing_came_leaves_no_store),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
