/*
 * The ledger where pulses are missing, late to be told, every fourth or none at all, and what it
 * does with all faults at once.
 */
#include "track/sync/ledger.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "ledger_device.h"

/* In some shots the trigger fired nothing: whole runs of up to five. */
static bool was_fired(uint64_t shot)
{
	return shot % 37 < 32 && shot % 11 != 3;
}

static void start_with_gaps(void)
{
	uint64_t missed = 0;

	ledger_init(&ledger, PERIOD_NS);
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 250; shot++) {
		if (was_fired(shot))
			assert_true(edges_add(&ledger.edges, shot, missed, time_of(shot)));
		missed = was_fired(shot) ? 0 : missed + 1;
	}
}

static void shots_that_nothing_was_fired_for_are_no_fault_of_a_camera(void **state)
{
	struct device ir = {.seq = 5}, hd = {.seq = 9};

	(void)state;
	for (uint32_t divider = 1; divider <= 4; divider += 3) {
		start_with_gaps();
		if (divider > 1)
			ledger_set_camera(&ledger, 0, divider, 0, 0);
		for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 250; shot++)
			if (was_fired(shot) && shot % divider == 0)
				assert_int_equal(take(divider > 1 ? &hd : &ir, shot), shot);
		expect_only(0);
	}
}

static void a_drop_beside_a_gap_is_still_found(void **state)
{
	struct device device = {0};

	(void)state;
	start_with_gaps();
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 250; shot++) {
		if (was_fired(shot) && was_fired(shot + 1) == false && shot > FIRST_SHOT + 100) {
			device.seq++; /* counted and not delivered, right before the gap */
			continue;
		}
		if (was_fired(shot))
			assert_int_equal(take(&device, shot), shot);
	}
	expect_only(ONLY(LEDGER_DROPPED));
}

static void hd_frames_belong_to_every_fourth_shot(void **state)
{
	struct device device = {.stamp_off_ns = 2 * MS};

	(void)state;
	start();
	ledger_set_camera(&ledger, 0, 4, 2, 2 * MS);
	for (uint64_t shot = FIRST_SHOT + 2; shot < FIRST_SHOT + 200; shot += 4) {
		struct ledger_frame frame = {device.seq++, time_of(shot) + 2 * MS,
					     time_of(shot) + 40 * MS};
		uint64_t found = 0;
		int64_t mid_exposure_ns;

		ledger_close(&ledger, shot + 3); /* HD comes later than any shot waits */
		assert_int_equal(ledger_judge(&ledger, 0, &frame, true, &found, &mid_exposure_ns),
				 LEDGER_TAKE);
		assert_int_equal(found, shot);
		assert_int_equal(mid_exposure_ns, time_of(shot) + 2 * MS);
	}
	expect_only(0);
}

static void an_hd_frame_one_tick_off_is_named_and_keeps_its_true_shot(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	ledger_set_camera(&ledger, 0, 4, 0, 0);
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 100; shot += 4)
		assert_int_equal(take(&device, shot + (shot >= FIRST_SHOT + 40)),
				 shot + (shot >= FIRST_SHOT + 40));
	expect_only(ONLY(LEDGER_PHASE_SLIPPED));
	assert_int_equal(count(LEDGER_PHASE_SLIPPED), 15);
	assert_int_equal(ledger.cameras[0].slip, 1);
	assert_int_equal(take(&device, FIRST_SHOT + 99), FIRST_SHOT + 99);
	assert_int_equal(ledger.cameras[0].slip, 3); /* one tick early */
	assert_int_equal(take(&device, FIRST_SHOT + 104), FIRST_SHOT + 104);
	assert_int_equal(ledger.cameras[0].slip, 0);
	assert_int_equal(count(LEDGER_PHASE_SLIPPED), 16);
}

static void a_frame_ahead_of_its_pulse_waits_for_it(void **state)
{
	struct ledger_frame frame = {0, time_of(FIRST_SHOT), time_of(FIRST_SHOT) + ARRIVAL_NS};
	uint64_t found = 0;
	int64_t mid_exposure_ns;

	(void)state;
	ledger_init(&ledger, PERIOD_NS);
	assert_int_equal(ledger_judge(&ledger, 0, &frame, false, &found, &mid_exposure_ns),
			 LEDGER_WAIT);
	edges_add(&ledger.edges, FIRST_SHOT, 0, time_of(FIRST_SHOT));
	assert_int_equal(ledger_judge(&ledger, 0, &frame, false, &found, &mid_exposure_ns),
			 LEDGER_TAKE);
	frame = (struct ledger_frame){1, time_of(FIRST_SHOT + 1), time_of(FIRST_SHOT + 1) + MS};
	assert_int_equal(ledger_judge(&ledger, 0, &frame, false, &found, &mid_exposure_ns),
			 LEDGER_WAIT);
	assert_int_equal(ledger_judge(&ledger, 0, &frame, true, &found, &mid_exposure_ns),
			 LEDGER_TAKE);
	assert_int_equal(found, FIRST_SHOT + 1);
}

static void a_frame_before_the_first_pulse_is_early(void **state)
{
	struct ledger_frame frame = {0, time_of(FIRST_SHOT) - PERIOD_NS, time_of(FIRST_SHOT)};
	uint64_t found;
	int64_t mid_exposure_ns;

	(void)state;
	start();
	assert_int_equal(ledger_judge(&ledger, 0, &frame, true, &found, &mid_exposure_ns),
			 LEDGER_EARLY);
	expect_only(0);
}

static void a_pulse_that_was_not_reported_is_still_a_shot(void **state)
{
	struct device device = {0};

	(void)state;
	ledger_init(&ledger, PERIOD_NS);
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 60; shot++)
		if (shot % 7)
			edges_add(&ledger.edges, shot, 0, time_of(shot));
	run(&device, FIRST_SHOT + 5, FIRST_SHOT + 58);
	expect_only(0);
}

static void without_pulses_repeats_are_refused_and_drops_counted(void **state)
{
	const struct ledger_frame frames[] = {{7, 10 * MS, 0}, {8, 20 * MS, 0},  {8, 20 * MS, 0},
					      {9, 20 * MS, 0}, {12, 60 * MS, 0}, {0, 70 * MS, 0}};
	const enum ledger_verdict expected[] = {LEDGER_TAKE,   LEDGER_TAKE, LEDGER_REFUSE,
						LEDGER_REFUSE, LEDGER_TAKE, LEDGER_TAKE};

	(void)state;
	ledger_init(&ledger, PERIOD_NS);
	for (int i = 0; i < 6; i++)
		assert_int_equal(ledger_watch(&ledger, 0, &frames[i]), expected[i]);
	assert_int_equal(count(LEDGER_REPEATED), 2);
	assert_int_equal(count(LEDGER_DROPPED), 2);
	assert_int_equal(count(LEDGER_RESTARTED), 1);
}

/* Drops, repeats, late ones, lost pulses and jitter all at once, each frame's truth known. */
static void storm(uint64_t seed)
{
	struct device device = {.seq = 9};
	struct rng rng;
	uint64_t taken = 0, frames = 0;
	bool missed = false; /* a stamp's error on top of it would cancel it: nothing shows that */

	rng_init(&rng, seed, 7);
	ledger_init(&ledger, PERIOD_NS);
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 20000; shot++) {
		double dice = rng_uniform(&rng);

		if (shot < FIRST_SHOT + 2 || rng_uniform(&rng) > 0.01)
			edges_add(&ledger.edges, shot, 0, time_of(shot));
		if (shot < FIRST_SHOT + 200 || missed)
			dice = 1;
		missed = dice >= 0.04 && dice < 0.05;
		device.stamp_off_ns = (int64_t)(rng_uniform(&rng) * MS) - MS / 2;
		device.late_ns = (int64_t)(rng_uniform(&rng) * 2 * MS);
		if (dice < 0.02) {
			device.seq++; /* dropped */
			continue;
		}
		if (dice < 0.03)
			device.stamp_off_ns += PERIOD_NS;
		else if (dice < 0.04)
			device.stamp_off_ns -= PERIOD_NS;
		else if (missed)
			continue;
		else if (dice < 0.055)
			device.seq++; /* counts one too many */
		else if (dice < 0.06)
			device.seq = 0;
		struct ledger_frame frame = {device.seq++, time_of(shot) + device.stamp_off_ns,
					     time_of(shot) + ARRIVAL_NS + device.late_ns};
		uint64_t found = 0;
		int64_t mid_exposure_ns;
		enum ledger_verdict verdict =
			ledger_judge(&ledger, 0, &frame, true, &found, &mid_exposure_ns);
		frames++;
		taken += verdict == LEDGER_TAKE;
		if (verdict == LEDGER_TAKE)
			assert_int_equal(found, shot);
	}
	assert_true(taken > frames * 9 / 10);
}

static void a_storm_of_faults_pairs_nothing_wrongly(void **state)
{
	(void)state;
	for (uint64_t seed = 1; seed <= 20; seed++)
		storm(seed);
}

static void pictures_tell_of_a_camera_out_of_step(void **state)
{
	(void)state;
	start();
	ledger_note_step(&ledger, 0, 5, -0.1);
	expect_only(0);
	ledger_note_step(&ledger, 0, 6, -0.9);
	ledger_note_step(&ledger, 0, 7, -0.5);
	ledger_note_step(&ledger, 0, 8, -1.0);
	assert_int_equal(count(LEDGER_OUT_OF_STEP), 1);
	assert_int_equal(ledger.cameras[0].event_shot, 6);
	assert_true(ledger.cameras[0].out_of_step);
	ledger_note_step(&ledger, 0, 9, 0.1);
	assert_false(ledger.cameras[0].out_of_step);
}

static void a_camera_without_light_is_dark(void **state)
{
	const struct ledger_blobs lit[] = {{70, 0}, {60, 0}, {50, 0}, {40, 0}};
	const struct ledger_blobs dark[] = {{1, 0}, {60, 0}, {50, 0}, {-1, 0}};
	const struct ledger_blobs empty[] = {{0, 0}, {0, 0}, {1, 0}, {0, 0}};

	(void)state;
	start();
	for (uint64_t shot = 0; shot < 30; shot++)
		ledger_note_blobs(&ledger, shot, shot < 10 ? empty : lit, 4);
	expect_only(0);
	for (uint64_t shot = 30; shot < 60; shot++)
		ledger_note_blobs(&ledger, shot, dark, 4);
	assert_int_equal(count(LEDGER_DARK), 1);
	assert_int_equal(ledger.cameras[3].counts[LEDGER_DARK], 0);
	ledger_note_blobs(&ledger, 60, lit, 4);
	assert_false(ledger.cameras[0].dark);
}

static void the_same_frames_leave_the_same_bytes(void **state)
{
	static struct ledger first;
	struct device device = {0};

	(void)state;
	for (int round = 0; round < 2; round++) {
		device = (struct device){0};
		start();
		run(&device, FIRST_SHOT, FIRST_SHOT + 50);
		device.seq += 2;
		run(&device, FIRST_SHOT + 53, FIRST_SHOT + 99);
		if (round == 0)
			first = ledger;
	}
	assert_memory_equal(&first, &ledger, sizeof(ledger));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(hd_frames_belong_to_every_fourth_shot),
		cmocka_unit_test(an_hd_frame_one_tick_off_is_named_and_keeps_its_true_shot),
		cmocka_unit_test(a_frame_ahead_of_its_pulse_waits_for_it),
		cmocka_unit_test(a_frame_before_the_first_pulse_is_early),
		cmocka_unit_test(a_pulse_that_was_not_reported_is_still_a_shot),
		cmocka_unit_test(shots_that_nothing_was_fired_for_are_no_fault_of_a_camera),
		cmocka_unit_test(a_drop_beside_a_gap_is_still_found),
		cmocka_unit_test(without_pulses_repeats_are_refused_and_drops_counted),
		cmocka_unit_test(a_storm_of_faults_pairs_nothing_wrongly),
		cmocka_unit_test(pictures_tell_of_a_camera_out_of_step),
		cmocka_unit_test(a_camera_without_light_is_dark),
		cmocka_unit_test(the_same_frames_leave_the_same_bytes),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
