/*
 * Bumped cameras are found and put right by a second of named markers; others stay as they are.
 */
#include "calib/rig/refine.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "aim_play.h"

#define SHOTS 40
#define EVERY 6

static struct aim_play aim;

static void begin(const char *scene, uint64_t seed, uint32_t cameras)
{
	assert_int_equal(aim_play_init(&aim, scene, seed, cameras), 0);
	aim_play_seconds(&aim, 0.5);
}

static void gather(struct marker_shots *shots, int count)
{
	for (int i = 0; i < count; i++) {
		struct shot shot = {.camera_count = aim.play.rig.camera_count};

		for (int k = 0; k < EVERY; k++)
			aim_play_shot(&aim);
		for (uint32_t c = 0; c < shot.camera_count; c++)
			shot.sets[c] = &aim.play.sets[c];
		assert_int_equal(marker_shots_add(shots, &shot, &aim.play.set), 0);
	}
}

static int refine_now(struct refined *refined, int count, struct diag *diag)
{
	struct marker_shots shots = {0};

	gather(&shots, count);
	int err = refine(refined, &aim.play.rig, &shots, diag);
	marker_shots_finish(&shots);
	return err;
}

static void take(const struct refined *refined)
{
	for (uint32_t c = 0; c < refined->camera_count; c++) {
		struct view *view = &aim.play.rig.views[c];
		struct pose back = pose_inverse(&refined->cameras[c].rt_cam_stage);

		view->rt_cam_stage = refined->cameras[c].rt_cam_stage;
		view->centre_stage_m = back.t;
	}
}

static double nees_over_3(void)
{
	struct score score;

	score_init(&score);
	aim_play_seconds(&aim, 0.3);
	for (int i = 0; i < 60; i++) {
		aim_play_shot(&aim);
		score_shot(&score, &aim.play.truth, &aim.play.set);
	}
	return score.nees / (double)score.measured / 3;
}

static double expect_put_right(uint32_t camera, struct vec3 turn_rad, struct vec3 shift_m)
{
	struct refined refined;
	struct diag diag = {0};

	aim_play_move(&aim, camera, turn_rad, shift_m);
	aim_play_seconds(&aim, 0.3);
	assert_int_equal(refine_now(&refined, SHOTS, &diag), 0);
	diag_finish(&diag);
	assert_int_equal(refined.moved_count, 1);
	assert_true(refined.cameras[camera].moved);
	take(&refined);
	double nees = nees_over_3();
	print_message(
		"# camera %u: %.3f px, %.3f mrad, %.2f mm; rms %.3f to %.3f px; nees/3 %.2f\n",
		camera, refined.cameras[camera].off_px, refined.cameras[camera].turned_mrad,
		refined.cameras[camera].moved_mm, refined.cameras[camera].before_px,
		refined.cameras[camera].after_px, nees);
	assert_true(refined.cameras[camera].after_px < 0.05);
	assert_true(nees > 0.7 && nees < 1.4); /* half a second: one draw of the rig's error */
	return nees;
}

static void a_bumped_camera_is_put_right(void **state)
{
	static const double TURNS_MRAD[] = {0.2, 1, 5};
	double nees = 0;

	(void)state;
	for (uint32_t i = 0; i < 3; i++) {
		double turn_rad = 1e-3 * TURNS_MRAD[i];

		begin("talking", 70 + i, 4 + 2 * i);
		nees += expect_put_right(
			i, (struct vec3){i % 2 ? turn_rad : 0, i % 2 ? 0 : turn_rad, 0},
			(struct vec3){0});
		nees += expect_put_right(3, (struct vec3){0, 0, 2e-3}, (struct vec3){0.5e-3, 0, 0});
		aim_play_finish(&aim);
	}
	assert_true(nees / 6 > 0.8 && nees / 6 < 1.25);
}

static void a_rig_that_was_not_bumped_stays_as_it_is(void **state)
{
	static const char *const SCENES[] = {"talking", "02-hidden", "11-body-and-face"};

	(void)state;
	for (uint64_t s = 0; s < 3; s++) {
		struct refined refined;
		struct diag diag = {0};

		begin(SCENES[s], 80 + s, 0);
		assert_int_equal(refine_now(&refined, SHOTS, &diag), 0);
		assert_int_equal(refined.moved_count, 0);
		for (uint32_t c = 0; c < refined.camera_count; c++)
			assert_memory_equal(&refined.cameras[c].rt_cam_stage,
					    &aim.play.rig.views[c].rt_cam_stage,
					    sizeof(struct pose));
		diag_finish(&diag);
		aim_play_finish(&aim);
	}
}

static void two_of_six_are_put_right_together(void **state)
{
	struct refined refined;
	struct diag diag = {0};

	(void)state;
	begin("talking", 90, 6);
	aim_play_move(&aim, 1, (struct vec3){1e-3, 0, 0}, (struct vec3){0});
	aim_play_move(&aim, 4, (struct vec3){0, -2e-3, 0}, (struct vec3){0});
	aim_play_seconds(&aim, 0.3);
	assert_int_equal(refine_now(&refined, SHOTS, &diag), 0);
	assert_int_equal(refined.moved_count, 2);
	assert_true(refined.cameras[1].moved && refined.cameras[4].moved);
	take(&refined);
	double nees = nees_over_3();
	print_message("# nees/3 %.2f\n", nees);
	assert_true(nees > 0.8 && nees < 1.25);
	diag_finish(&diag);
	aim_play_finish(&aim);
}

static void too_little_is_refused_with_a_remedy(void **state)
{
	struct refined refined;
	struct diag diag = {0};

	(void)state;
	begin("talking", 95, 4);
	assert_int_equal(refine_now(&refined, 5, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "--seconds"));
	diag_finish(&diag);
	diag = (struct diag){0};
	for (uint32_t c = 0; c < 3; c++) /* three of four: who holds the frame? */
		aim_play_move(&aim, c, (struct vec3){c == 1 ? 2e-3 : 0, c == 1 ? 0 : 1e-3, 0},
			      (struct vec3){0});
	assert_int_equal(refine_now(&refined, SHOTS, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "calibrate cameras"));
	diag_finish(&diag);
	aim_play_finish(&aim);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_bumped_camera_is_put_right),
		cmocka_unit_test(a_rig_that_was_not_bumped_stays_as_it_is),
		cmocka_unit_test(two_of_six_are_put_right_together),
		cmocka_unit_test(too_little_is_refused_with_a_remedy),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
