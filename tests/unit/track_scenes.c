/*
 * Whole scenes at blob level through the tracker: names right, none wrong, covariances true, the
 * same bytes on every run.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sim/play.h"

static const struct blob_play CLEAN = {.sigma_px = 0.03, .merge_px = 2.5};

struct run {
	struct sim_options options;
	struct blob_play play;
	uint64_t first, count;
};

static struct score play(const struct run *run)
{
	static struct sim_play stage;
	struct score score;

	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &run->options, NULL), 0);
	score_init(&score);
	for (uint64_t n = run->first; n < run->first + run->count; n++) {
		sim_play_shot_us(&stage, &run->play, n, 0);
		score_shot(&score, &stage.truth, &stage.set);
	}
	sim_play_finish(&stage);
	return score;
}

static double right_share(const struct score *score)
{
	return (double)score->right / (double)score->seen3;
}

static void a_talking_head_keeps_its_names(void **state)
{
	(void)state;
	for (uint64_t seed = 21; seed < 24; seed++) {
		struct score s = play(&(struct run){
			{.scene = "talking", .seed = seed, .camera_count = 4, .rate_hz = 60},
			CLEAN,
			0,
			240});

		assert_true(right_share(&s) > 0.998);
		assert_int_equal(s.wrong, 0);
		assert_true(sqrt(s.error2_m2 / (double)s.measured) < 5e-5);
	}
}

static void names_come_back_after_a_wide_turn(void **state)
{
	(void)state;
	struct score s = play(
		&(struct run){{.scene = "turning", .seed = 31, .camera_count = 8, .rate_hz = 120},
			      CLEAN,
			      0,
			      600});

	assert_true(right_share(&s) > 0.998);
	assert_int_equal(s.wrong, 0);
	assert_int_equal(s.heads, s.shots);
}

static void names_are_found_in_the_middle_of_speech(void **state)
{
	(void)state;
	for (uint64_t seed = 41; seed < 44; seed++) {
		struct score s = play(&(struct run){
			{.scene = "talking", .seed = seed, .camera_count = 8, .rate_hz = 120},
			CLEAN,
			500 + 37 * seed,
			120});

		assert_int_equal(s.wrong, 0);
		assert_true(s.first_named_shot >= 0 && s.first_named_shot < 60);
	}
}

static void a_start_in_the_middle_of_speech_swaps_no_name(void **state)
{
	(void)state;
	for (uint64_t seed = 1; seed < 5; seed++)
		for (uint64_t start = 0; start < 3; start++) {
			struct score s = play(&(struct run){{.scene = "talking",
							     .seed = seed,
							     .camera_count = 8,
							     .rate_hz = 120},
							    {.lost_share = 0.01, .stray_count = 5},
							    144 + 18 * seed + 131 * start,
							    120});

			assert_int_equal(s.wrong, 0);
			assert_true(right_share(&s) > 0.95);
		}
}

static void thirty_shots_a_second_are_enough(void **state)
{
	(void)state;
	struct score s = play(&(struct run){
		{.scene = "talking", .seed = 51, .camera_count = 8, .rate_hz = 30}, CLEAN, 0, 120});

	assert_true(right_share(&s) > 0.998);
	assert_int_equal(s.wrong, 0);
}

/* It is millimetres off what its motion told; its pressed lips are parted all the same. */
static void a_head_that_starts_between_two_shots_is_sought(void **state)
{
	(void)state;
	struct score s = play(&(struct run){.options = {.scene = "dense-thirty",
							.seed = 55003,
							.camera_count = 8,
							.rate_hz = 30,
							.face_speed_m_s = 0.6},
					    .count = 450});

	assert_true(right_share(&s) > 0.9995);
	assert_int_equal(s.wrong, 0);
	for (int i = 0; i < SCORE_BINS; i++)
		assert_true(s.bins[i].nees / 3 < 1.5 * (double)s.bins[i].count);
}

static void noise_strays_and_lost_spots_give_no_wrong_name(void **state)
{
	(void)state;
	struct score s = play(&(struct run){
		{.scene = "talking", .seed = 62, .camera_count = 6, .rate_hz = 120},
		{.sigma_px = 0.3, .merge_px = 3, .lost_share = 0.05, .stray_count = 20},
		0,
		240});

	assert_int_equal(s.wrong, 0);
	assert_true(right_share(&s) > 0.97);
}

static void covariances_hold_for_blobs_that_claim_too_much(void **state)
{
	static struct sim_play stage;
	struct sim_options options = {
		.scene = "talking", .seed = 71, .camera_count = 6, .rate_hz = 120};
	struct score score;

	(void)state;
	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &options, NULL), 0);
	score_init(&score);
	for (uint64_t n = 0; n < 240; n++) {
		struct blob_play boasting = {.sigma_px = 0.2, .claimed_px = 0.03};

		sim_play_shot_us(&stage, &boasting, n, 0);
		if (n >= 60) /* half a second to learn it */
			score_shot(&score, &stage.truth, &stage.set);
	}
	sim_play_finish(&stage);
	double nees = score.nees / (double)score.measured / 3;
	print_message("# nees / 3 = %.2f\n", nees);
	assert_true(nees > 0.8 && nees < 1.25);
}

static void covariances_hold_after_a_camera_was_bumped(void **state)
{
	struct sim_faults faults = {.count = 1,
				    .faults = {{.camera = "ir3",
						.device = "ir3",
						.kind = SIM_FAULT_BUMP,
						.at_s = 1,
						.every = 1,
						.angle_mrad = 0.2}}};

	(void)state;
	struct score s = play(&(struct run){
		{.scene = "talking", .seed = 41, .camera_count = 8, .faults = &faults},
		CLEAN,
		0,
		480});
	print_message("# nees / 3 = %.2f\n", s.nees / 3 / (double)s.measured);
	assert_true(right_share(&s) > 0.995);
	assert_true(s.nees > 3 * 0.75 * (double)s.measured);
	assert_true(s.nees < 3 * 1.2 * (double)s.measured);
}

static void one_dead_camera_costs_no_names(void **state)
{
	static struct sim_play stage;
	struct sim_options options = {
		.scene = "talking", .seed = 81, .camera_count = 8, .rate_hz = 120};
	struct score score;

	(void)state;
	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &options, NULL), 0);
	score_init(&score);
	for (uint64_t n = 0; n < 180; n++) {
		sim_play_shot_us(&stage, &CLEAN, n, n >= 60 && n < 120 ? 1u << 3 : 0);
		score_shot(&score, &stage.truth, &stage.set);
	}
	sim_play_finish(&stage);
	assert_int_equal(score.wrong, 0);
	assert_true(right_share(&score) > 0.97); /* the truth counts the dead camera too */
}

/* Right names over those seen by three cameras, in the shots from the stall's end on. */
static struct score play_stall(uint32_t missing_mask, uint64_t first, uint64_t length)
{
	static struct sim_play stage;
	struct sim_options options = {
		.scene = "talking", .seed = 85, .camera_count = 4, .rate_hz = 60};
	struct score score, all;

	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &options, NULL), 0);
	score_init(&score);
	score_init(&all);
	for (uint64_t n = first - 30; n < first + length + 60; n++) {
		bool stalled = n >= first && n < first + length;

		sim_play_shot_us(&stage, &CLEAN, n, stalled ? missing_mask : 0);
		score_shot(&all, &stage.truth, &stage.set);
		if (n >= first + length + 30)
			score_shot(&score, &stage.truth, &stage.set);
	}
	sim_play_finish(&stage);
	score.wrong = all.wrong;
	return score;
}

static void a_stall_costs_names_for_a_moment_and_swaps_none(void **state)
{
	(void)state;
	for (uint64_t trial = 0; trial < 12; trial++) {
		uint32_t missing_mask = trial % 3 == 0 ? 0xf : trial % 3 == 1 ? 0x9 : 0x7;
		struct score s = play_stall(missing_mask, 100 + 77 * trial, 2 + 3 * (trial % 5));

		assert_int_equal(s.wrong, 0);
		assert_true(right_share(&s) > 0.98);
	}
}

static void four_actors_and_their_bodies_are_told_apart(void **state)
{
	(void)state;
	struct score s = play(
		&(struct run){{.scene = "four-actors", .seed = 2, .rate_hz = 60}, CLEAN, 0, 150});

	assert_int_equal(s.wrong, 0);
	assert_true(right_share(&s) > 0.97);
	assert_int_equal(s.heads, s.shots);
}

static void the_same_shots_give_the_same_state(void **state)
{
	static struct sim_play stages[2];
	struct sim_options options = {
		.scene = "talking", .seed = 91, .camera_count = 5, .rate_hz = 120};

	(void)state;
	memset(stages, 0, sizeof(stages));
	for (int i = 0; i < 2; i++) {
		assert_int_equal(sim_play_init(&stages[i], &options, NULL), 0);
		for (uint64_t n = 0; n < 60; n++)
			sim_play_shot_us(&stages[i], &CLEAN, n, 0);
	}
	assert_memory_equal(&stages[0].state, &stages[1].state, sizeof(stages[0].state));
	assert_memory_equal(stages[0].set.markers, stages[1].set.markers,
			    stages[0].set.marker_count * sizeof(stages[0].set.markers[0]));
	for (int i = 0; i < 2; i++)
		sim_play_finish(&stages[i]);
}

/* Shots are lost now and then, so that some do not come when they were expected, and for a while
 * all cameras are blind, so that the head is given up. */
static void play_prepared_and_not(double rate_hz)
{
	static struct sim_play stages[2];
	struct sim_options options = {
		.scene = "talking", .seed = 93, .camera_count = 5, .rate_hz = rate_hz};

	memset(stages, 0, sizeof(stages));
	for (int i = 0; i < 2; i++)
		assert_int_equal(sim_play_init(&stages[i], &options, NULL), 0);
	for (uint64_t n = 0; n < 160; n += n % 17 == 0 ? 2 : 1) {
		for (int i = 0; i < 2; i++) {
			if (i == 1)
				tracker_prepare(&stages[i].state, stages[i].scratch,
						&stages[i].tracker_rig);
			sim_play_shot_us(&stages[i], &CLEAN, n, n > 80 && n < 120 ? 0x1f : 0);
		}
		assert_memory_equal(&stages[0].state, &stages[1].state, sizeof(stages[0].state));
		assert_memory_equal(stages[0].set.markers, stages[1].set.markers,
				    stages[0].set.marker_count * sizeof(stages[0].set.markers[0]));
	}
	for (int i = 0; i < 2; i++)
		sim_play_finish(&stages[i]);
}

static void preparing_ahead_changes_no_bit(void **state)
{
	(void)state;
	play_prepared_and_not(120);
	play_prepared_and_not(30);
}

static void an_empty_stage_gives_empty_sets(void **state)
{
	static struct sim_play stage;
	struct sim_options options = {
		.scene = "talking", .seed = 95, .camera_count = 4, .rate_hz = 60};

	(void)state;
	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &options, NULL), 0);
	for (uint64_t n = 0; n < 10; n++) {
		sim_play_shot_us(&stage, &CLEAN, n, 0xf);
		assert_int_equal(stage.set.heads[0].valid, 0);
		for (uint32_t i = 0; i < stage.set.marker_count; i++)
			assert_int_equal(stage.set.markers[i].status, MARKER_MISSING);
	}
	sim_play_finish(&stage);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_talking_head_keeps_its_names),
		cmocka_unit_test(names_come_back_after_a_wide_turn),
		cmocka_unit_test(names_are_found_in_the_middle_of_speech),
		cmocka_unit_test(a_start_in_the_middle_of_speech_swaps_no_name),
		cmocka_unit_test(thirty_shots_a_second_are_enough),
		cmocka_unit_test(a_head_that_starts_between_two_shots_is_sought),
		cmocka_unit_test(noise_strays_and_lost_spots_give_no_wrong_name),
		cmocka_unit_test(covariances_hold_for_blobs_that_claim_too_much),
		cmocka_unit_test(covariances_hold_after_a_camera_was_bumped),
		cmocka_unit_test(one_dead_camera_costs_no_names),
		cmocka_unit_test(a_stall_costs_names_for_a_moment_and_swaps_none),
		cmocka_unit_test(four_actors_and_their_bodies_are_told_apart),
		cmocka_unit_test(the_same_shots_give_the_same_state),
		cmocka_unit_test(preparing_ahead_changes_no_bit),
		cmocka_unit_test(an_empty_stage_gives_empty_sets),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
