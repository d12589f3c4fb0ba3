/*
 * The stage frame by board and by L-frame is where the truth has it; what is doubtful is refused.
 */
#include "calib/rig/origin.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "aim_play.h"
#include "base/rng.h"
#include "calib_wave.h"

#define LONG_M 0.4
#define SHORT_M 0.25
#define NOISE_M 0.1e-3

static struct aim_play aim; /* for its rig */

static void expect_near(const struct origin *origin, const struct pose *rt_stage_new)
{
	struct pose off = pose_compose(&origin->rt_new_stage, rt_stage_new);
	double off_mm = 1e3 * vec3_norm(off.t);
	double off_mrad = 1e3 * vec3_norm(pose_to_rotation_vector(&off));

	print_message("# origin %.3f mm and %.3f mrad off\n", off_mm, off_mrad);
	assert_true(off_mm < 0.2 && off_mrad < 0.5);
}

static void a_board_at_rest_gives_the_frame(void **state)
{
	const struct wave wave = {
		.ir_count = 8,
		.pose_count = 1,
		.board = {.squares_x = 11, .squares_y = 8, .square_m = 0.035, .tag_part = 0.7},
		.noise_px = 0.05,
		.seed = 3};
	struct diag diag = {0};
	struct origin origin;
	struct waved waved;

	(void)state;
	assert_int_equal(aim_play_init(&aim, "talking", 3, 8), 0);
	wave_make(&waved, &wave);
	assert_int_equal(origin_of_board(&origin, &aim.play.rig, &waved.observations, &diag), 0);
	/* y up and z out of the print */
	struct pose turned = {.r = {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
	struct pose truth = pose_compose(&waved.rt_stage_board[0], &turned);
	expect_near(&origin, &truth);
	for (uint32_t v = 0; v < waved.observations.view_count; v++) /* nobody sees it together */
		waved.observations.views[v].pose = v;
	assert_int_equal(origin_of_board(&origin, &aim.play.rig, &waved.observations, &diag),
			 -EINVAL);
	assert_non_null(strstr(diag.text, "two calibrated cameras"));
	diag_finish(&diag);
	wave_finish(&waved);
	aim_play_finish(&aim);
}

static struct vec3 jitter(struct vec3 p_m, struct rng *rng)
{
	return vec3_add(p_m, (struct vec3){NOISE_M * rng_normal(rng), NOISE_M * rng_normal(rng),
					   NOISE_M * rng_normal(rng)});
}

/* 20 shots of an L-frame that lies as `rt` says, with one marker more at `other_m` of it. */
static void lay(struct marker_shots *shots, const struct pose *rt, double turn, struct vec3 other_m)
{
	const struct vec3 places_m[] = {{0, 0, 0}, {LONG_M, 0, 0}, {0, turn * SHORT_M, 0}, other_m};
	struct rng rng;

	rng_init(&rng, 9, 1);
	for (uint64_t n = 0; n < 20; n++) {
		struct shot shot = {.number = n};
		static struct marker_set set;

		set.marker_count = 4;
		for (int m = 0; m < 4; m++)
			set.markers[m] = (struct marker){
				.label = LABEL_NONE,
				.status = MARKER_MEASURED,
				.p_stage_m = jitter(pose_apply(rt, places_m[m]), &rng)};
		assert_int_equal(marker_shots_add(shots, &shot, &set), 0);
	}
}

static struct pose somewhere(void)
{
	struct pose rt = pose_from_rotation_vector((struct vec3){0.02, -0.03, 0.8});

	rt.t = (struct vec3){0.1, -0.2, 0.05};
	return rt;
}

static int origin_by(struct origin *origin, double turn, struct vec3 other_m, double long_m,
		     double short_m, struct diag *diag)
{
	struct marker_shots shots = {0};
	struct pose rt = somewhere();

	lay(&shots, &rt, turn, other_m);
	int err = origin_of_l_frame(origin, &aim.play.rig, &shots, long_m, short_m, diag);
	marker_shots_finish(&shots);
	return err;
}

static const struct vec3 ASIDE = {0.31, 0.17, 0.4};

static void an_l_frame_gives_the_frame(void **state)
{
	struct pose truth = somewhere();
	struct diag diag = {0};
	struct origin origin;

	(void)state;
	assert_int_equal(aim_play_init(&aim, "talking", 3, 4), 0);
	assert_int_equal(origin_by(&origin, 1, ASIDE, LONG_M, SHORT_M, &diag), 0);
	expect_near(&origin, &truth);
	diag_finish(&diag);
	aim_play_finish(&aim);
}

static void expect_refused(double turn, struct vec3 other_m, double long_m, double short_m,
			   const char *why)
{
	struct diag diag = {0};
	struct origin origin;

	assert_int_equal(origin_by(&origin, turn, other_m, long_m, short_m, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, why));
	diag_finish(&diag);
}

static void a_doubtful_l_frame_is_refused(void **state)
{
	(void)state;
	assert_int_equal(aim_play_init(&aim, "talking", 3, 4), 0);
	expect_refused(1, ASIDE, 0.3, 0.3, "cannot be told apart");
	expect_refused(1, ASIDE, 0.45, SHORT_M, "measure the arms");
	expect_refused(1, (struct vec3){0, -SHORT_M, 0}, LONG_M, SHORT_M, "more than one");
	expect_refused(-1, ASIDE, LONG_M, SHORT_M, "z would point down");
	aim_play_finish(&aim);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_board_at_rest_gives_the_frame),
		cmocka_unit_test(an_l_frame_gives_the_frame),
		cmocka_unit_test(a_doubtful_l_frame_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
