/*
 * What is learned of a rig from how well its views agree.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "tests/bench/points_world.h"
#include "track/excess.h"

enum { CAMERAS = 8, MARKERS = 70, SHOTS = 120 };

#define OFF_PX 0.03
#define VAGUE_PX 0.3F

static struct world world;
static struct matcher matcher;
static struct tracker_state state;
static struct tracker_rig rig;
static struct rng rng;

static int make_rig(void **test_state)
{
	struct world_shape shape = {CAMERAS, 1, MARKERS, {0.075, 0.11, 0.09}, 0.012, 0.2};

	(void)test_state;
	memset(&state, 0, sizeof(state));
	rng_init(&rng, 4, 0);
	world_init(&world, &shape, 4);
	rig = (struct tracker_rig){.camera_count = CAMERAS,
				   .layout = &world.layout,
				   .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < CAMERAS; c++)
		rig.views[c] = &world.rig.views[c];
	return 0;
}

static int finish_rig(void **test_state)
{
	(void)test_state;
	world_finish(&world);
	return 0;
}

static void add_noise(struct blob *blob, double sigma_px)
{
	blob->x_px += (float)(sigma_px * rng_normal(&rng));
	blob->y_px += (float)(sigma_px * rng_normal(&rng));
}

/* Every blob is off by more than its sigma says, but for the vague ones, which are surer than they
 * say. */
static void disturb(double off_px, double vague_share)
{
	for (uint32_t c = 0; c < CAMERAS; c++)
		for (uint32_t b = 0; b < world.sets[c].blob_count; b++) {
			struct blob *blob = &world.sets[c].blobs[b];
			bool vague = rng_uniform(&rng) < vague_share;

			add_noise(blob, vague ? VAGUE_PX / 2 : off_px);
			if (vague)
				blob->sigma_px = VAGUE_PX;
		}
}

static void match(int number)
{
	struct seed seeds[MARKERS];
	struct shot shot;

	world_play(&world, (uint64_t)number, 1000000000 + number * 8333333LL, &shot);
	for (int i = 0; i < MARKERS; i++)
		seeds[i] = (struct seed){world.truth_m[0][i], 0.002, (int16_t)i, 0};
	match_begin(&matcher, &rig, &state.excess, &shot);
	match_prepare(&matcher, &rig, seeds, MARKERS);
}

static double learned_px(double off_px, double vague_share)
{
	for (int n = 0; n < SHOTS; n++) {
		match(n);
		disturb(off_px, vague_share);
		match_seeds(&matcher);
		excess_learn(&state, &matcher);
	}
	print_message("# off by %.3f px: %.4f px\n", off_px, sqrt(state.excess.all_px2));
	return sqrt(state.excess.all_px2);
}

static void views_that_agree_teach_nothing(void **test_state)
{
	(void)test_state;
	assert_true(learned_px(0, 0) < 0.005);
}

static void what_spots_do_not_tell_is_learned(void **test_state)
{
	(void)test_state;
	assert_true(fabs(learned_px(OFF_PX, 0) - OFF_PX) < 0.15 * OFF_PX);
}

static void vague_spots_do_not_outvote_exact_ones(void **test_state)
{
	(void)test_state;
	assert_true(fabs(learned_px(OFF_PX, 0.4) - OFF_PX) < 0.15 * OFF_PX);
}

/* Points of several markers' spots. */
static double learned_of_mixed_px(uint32_t bad)
{
	for (int n = 0; n < SHOTS; n++) {
		match(n);
		match_seeds(&matcher);
		for (uint32_t p = 0; p < bad; p++) {
			matcher.points[p].fix.p_stage_m.x += 0.001;
			matcher.points[p].fix.chi2_per_dof = 100;
		}
		excess_learn(&state, &matcher);
	}
	print_message("# %u of %d: %.4f px\n", bad, MARKERS, sqrt(state.excess.all_px2));
	return sqrt(state.excess.all_px2);
}

static void a_mixed_point_does_not_speak_for_the_rig(void **test_state)
{
	(void)test_state;
	assert_true(learned_of_mixed_px(2) < 0.005);
}

static void a_rig_that_is_off_is_told_by_many(void **test_state)
{
	(void)test_state;
	assert_true(learned_of_mixed_px(MARKERS / 5) > 0.05);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(views_that_agree_teach_nothing, make_rig,
						finish_rig),
		cmocka_unit_test_setup_teardown(what_spots_do_not_tell_is_learned, make_rig,
						finish_rig),
		cmocka_unit_test_setup_teardown(vague_spots_do_not_outvote_exact_ones, make_rig,
						finish_rig),
		cmocka_unit_test_setup_teardown(a_mixed_point_does_not_speak_for_the_rig, make_rig,
						finish_rig),
		cmocka_unit_test_setup_teardown(a_rig_that_is_off_is_told_by_many, make_rig,
						finish_rig),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
