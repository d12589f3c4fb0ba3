/*
 * A camera that was bumped is named soon, and nobody is without a reason.
 */
#include "aim_play.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define BUMP_RAD 0.2e-3
#define SOON_S 2.0

static struct aim_play aim;

static void begin(const char *scene, uint64_t seed, uint32_t camera_count)
{
	assert_int_equal(aim_play_init(&aim, scene, seed, camera_count), 0);
	aim_play_seconds(&aim, 1.0);
}

/* Any time from the last answer on. */
static void expect_named(uint32_t camera, struct vec3 turn_rad, struct vec3 shift_m)
{
	struct pose before = aim.play.rig.views[camera].rt_cam_stage;
	uint32_t named = UINT32_MAX;

	aim_play_seconds(&aim, 0.07 * (camera % 4));
	aim_play_move(&aim, camera, turn_rad, shift_m);
	double after_s = aim_play_until_named(&aim, 3, &named);
	assert_int_equal(named, camera);
	assert_true(after_s <= SOON_S);
	assert_true(aim.ledger.cameras[camera].moved);
	aim_play_put_back(&aim, camera, before);
	assert_false(aim.ledger.cameras[camera].moved);
}

static void a_turned_camera_is_named_within_two_seconds(void **state)
{
	(void)state;
	for (uint32_t count = 4; count <= 11; count += 7) {
		begin("talking", 20 + count, count);
		for (uint32_t c = 0; c < count; c += 3)
			expect_named(c,
				     (struct vec3){c % 2 ? BUMP_RAD : 0, c % 2 ? 0 : BUMP_RAD, 0},
				     (struct vec3){0});
		aim_play_finish(&aim);
	}
}

static void a_shifted_or_far_turned_camera_is_named_too(void **state)
{
	(void)state;
	begin("talking", 31, 6);
	expect_named(1, (struct vec3){0}, (struct vec3){0.4e-3, 0, 0});
	expect_named(4, (struct vec3){0, 2e-3, 0}, (struct vec3){0});
	expect_named(5, (struct vec3){0, 10e-3, 0}, (struct vec3){0});
	expect_named(2, (struct vec3){0, 0, 3e-3}, (struct vec3){0}); /* rolled */
	aim_play_finish(&aim);
}

static void the_turn_is_told(void **state)
{
	(void)state;
	begin("talking", 41, 8);
	aim_play_move(&aim, 3, (struct vec3){0.3e-3, 0, 0}, (struct vec3){0});
	aim_play_seconds(&aim, 3.5);
	const struct ledger_camera *camera = &aim.ledger.cameras[3];
	print_message("# %.3f px, %.3f mrad\n", camera->moved_px, camera->moved_mrad);
	assert_true(fabs(camera->moved_mrad - 0.3) < 0.05);
	assert_true(camera->moved_px > 0.3 && camera->moved_px < 0.8);
	aim_play_finish(&aim);
}

static void a_slow_drift_is_named_before_it_is_a_tenth_of_a_milliradian(void **state)
{
	uint32_t named = UINT32_MAX;
	double drifted_mrad = 0;

	(void)state;
	begin("talking", 51, 6);
	while (named == UINT32_MAX && drifted_mrad < 0.2) {
		aim_play_move(&aim, 2, (struct vec3){1e-6, 0, 0}, (struct vec3){0});
		drifted_mrad += 1e-3;
		aim_play_until_named(&aim, 0.1, &named); /* 0.01 mrad/s */
	}
	print_message("# named at %.3f mrad\n", drifted_mrad);
	assert_int_equal(named, 2);
	assert_true(drifted_mrad < 0.1);
	aim_play_finish(&aim);
}

static void nobody_is_named_without_a_reason(void **state)
{
	static const char *const SCENES[] = {"02-hidden", "04-head-shake", "11-body-and-face"};
	uint32_t named;

	(void)state;
	for (uint64_t s = 0; s < 3; s++) {
		assert_int_equal(aim_play_init(&aim, SCENES[s], 9 + s, 0), 0);
		assert_true(isnan(aim_play_until_named(&aim, 8, &named)));
		aim_play_finish(&aim);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_turned_camera_is_named_within_two_seconds),
		cmocka_unit_test(a_shifted_or_far_turned_camera_is_named_too),
		cmocka_unit_test(the_turn_is_told),
		cmocka_unit_test(a_slow_drift_is_named_before_it_is_a_tenth_of_a_milliradian),
		cmocka_unit_test(nobody_is_named_without_a_reason),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
