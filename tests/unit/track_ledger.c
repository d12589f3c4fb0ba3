/*
 * The ledger against a camera's faults, with frames whose true shot is known: whatever goes wrong,
 * no frame is taken for another shot's, and what went wrong has its name and number.
 */
#include "track/sync/ledger.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "ledger_device.h"

static void every_event_has_a_name(void **state)
{
	(void)state;
	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		assert_non_null(ledger_event_name((enum ledger_event)e));
	assert_null(ledger_event_name(LEDGER_EVENT_COUNT));
}

static void frames_in_step_make_no_event(void **state)
{
	struct device device = {.seq = 77};

	(void)state;
	start();
	run(&device, FIRST_SHOT + 30, FIRST_SHOT + 240); /* from mid-stream on */
	expect_only(0);
}

static void jitter_at_the_margin_follows_the_counter(void **state)
{
	struct device device = {0};
	struct rng rng;

	(void)state;
	start();
	rng_init(&rng, 5, 0);
	run(&device, FIRST_SHOT, FIRST_SHOT + 9);
	for (uint64_t shot = FIRST_SHOT + 10; shot < FIRST_SHOT + 240; shot++) {
		struct ledger_frame frame = {
			device.seq++,
			time_of(shot) + (int64_t)((rng_uniform(&rng) - 0.5) * 1.4 * PERIOD_NS),
			time_of(shot) + 10 * MS};
		uint64_t found = 0;
		int64_t mid_exposure_ns;

		assert_int_equal(ledger_judge(&ledger, 0, &frame, true, &found, &mid_exposure_ns),
				 LEDGER_TAKE);
		assert_int_equal(found, shot);
	}
	expect_only(0);
}

static void a_dropped_frame_is_counted_with_its_shot(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 9);
	device.seq += 3;
	run(&device, FIRST_SHOT + 13, FIRST_SHOT + 30);
	expect_only(ONLY(LEDGER_DROPPED));
	assert_int_equal(count(LEDGER_DROPPED), 3);
	assert_int_equal(ledger.cameras[0].event, LEDGER_DROPPED);
	assert_int_equal(ledger.cameras[0].event_shot, FIRST_SHOT + 10);
}

static void a_repeated_frame_is_refused(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 9);
	device.seq--;
	assert_int_equal(take(&device, FIRST_SHOT + 9), 0);
	run(&device, FIRST_SHOT + 10, FIRST_SHOT + 20);
	device.seq -= 5; /* an old one once more */
	assert_int_equal(take(&device, FIRST_SHOT + 16), 0);
	device.seq += 4;
	run(&device, FIRST_SHOT + 21, FIRST_SHOT + 30);
	expect_only(ONLY(LEDGER_REPEATED));
	assert_int_equal(count(LEDGER_REPEATED), 2);
}

static void a_repeat_that_the_device_counted_moves_nothing(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 9);
	assert_int_equal(take(&device, FIRST_SHOT + 9), 0); /* same image, next number */
	run(&device, FIRST_SHOT + 10, FIRST_SHOT + 20);
	assert_int_equal(take(&device, FIRST_SHOT + 20), 0); /* in the place of the next image */
	run(&device, FIRST_SHOT + 22, FIRST_SHOT + 30);
	expect_only(ONLY(LEDGER_REPEATED));
}

static void a_late_frame_is_refused_and_those_behind_it_are_not(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 9);
	ledger_close(&ledger, FIRST_SHOT + 11);
	assert_int_equal(take(&device, FIRST_SHOT + 10), 0);
	assert_int_equal(take(&device, FIRST_SHOT + 11), 0);
	run(&device, FIRST_SHOT + 12, FIRST_SHOT + 20);
	expect_only(ONLY(LEDGER_LATE));
	assert_int_equal(count(LEDGER_LATE), 2);
}

static void a_stamp_one_period_ahead_is_put_right_by_the_counter(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 149);
	device.stamp_off_ns = PERIOD_NS;
	run(&device, FIRST_SHOT + 150, FIRST_SHOT + 180);
	device.stamp_off_ns = 0;
	run(&device, FIRST_SHOT + 181, FIRST_SHOT + 200);
	expect_only(ONLY(LEDGER_SHIFTED));
	assert_int_equal(count(LEDGER_SHIFTED), 31);
}

static void a_stamp_one_period_behind_is_put_right_by_the_counter(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 149);
	device.stamp_off_ns = 1000 - PERIOD_NS;
	run(&device, FIRST_SHOT + 150, FIRST_SHOT + 180);
	device.stamp_off_ns = 0;
	run(&device, FIRST_SHOT + 181, FIRST_SHOT + 200);
	expect_only(ONLY(LEDGER_SHIFTED));
	assert_int_equal(count(LEDGER_SHIFTED), 31);
}

static void a_stamp_made_on_late_arrival_is_refused_not_believed(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 149);
	device.stamp_off_ns = device.late_ns = PERIOD_NS;
	for (uint64_t shot = FIRST_SHOT + 150; shot < FIRST_SHOT + 153; shot++)
		assert_int_equal(take(&device, shot), 0);
	device.stamp_off_ns = device.late_ns = 0;
	assert_int_equal(take(&device, FIRST_SHOT + 153), 0); /* one return may be chance */
	run(&device, FIRST_SHOT + 154, FIRST_SHOT + 200);
	expect_only(ONLY(LEDGER_DOUBTFUL));
}

static void a_missed_trigger_costs_three_frames_and_is_named(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 149);
	for (uint64_t shot = FIRST_SHOT + 151; shot < FIRST_SHOT + 154; shot++)
		assert_int_equal(take(&device, shot), 0);
	run(&device, FIRST_SHOT + 154, FIRST_SHOT + 200);
	expect_only(ONLY(LEDGER_MISSED_TRIGGER) | ONLY(LEDGER_DOUBTFUL));
	assert_int_equal(count(LEDGER_MISSED_TRIGGER), 1);
	assert_int_equal(count(LEDGER_DOUBTFUL), 3);
}

static void a_counter_that_jumps_is_not_followed(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 149);
	device.seq++;
	for (uint64_t shot = FIRST_SHOT + 150; shot < FIRST_SHOT + 153; shot++)
		assert_int_equal(take(&device, shot), 0);
	run(&device, FIRST_SHOT + 153, FIRST_SHOT + 200);
	expect_only(ONLY(LEDGER_COUNTER_JUMPED) | ONLY(LEDGER_DOUBTFUL));
}

static void a_wrong_first_frame_is_outvoted_by_the_next_two(void **state)
{
	struct device device = {.stamp_off_ns = PERIOD_NS};

	(void)state;
	start();
	take(&device, FIRST_SHOT + 5);
	device.stamp_off_ns = 0;
	assert_int_equal(take(&device, FIRST_SHOT + 6), 0);
	run(&device, FIRST_SHOT + 7, FIRST_SHOT + 20);
}

static void a_counter_that_begins_anew_is_taken_up(void **state)
{
	struct device device = {.seq = 500};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 20);
	device.seq = 0;
	run(&device, FIRST_SHOT + 21, FIRST_SHOT + 40);
	device.seq = 0;
	run(&device, FIRST_SHOT + 140, FIRST_SHOT + 160); /* unplugged for a while */
	expect_only(ONLY(LEDGER_RESTARTED));
	assert_int_equal(count(LEDGER_RESTARTED), 2);
}

static void a_frozen_camera_has_missed_its_triggers(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 20);
	run(&device, FIRST_SHOT + 71, FIRST_SHOT + 90);
	expect_only(ONLY(LEDGER_MISSED_TRIGGER));
	assert_int_equal(count(LEDGER_MISSED_TRIGGER), 50);
}

static void a_counter_that_wraps_in_64_bits_goes_on(void **state)
{
	struct device device = {.seq = UINT64_MAX - 10};

	(void)state;
	start();
	run(&device, FIRST_SHOT, FIRST_SHOT + 40);
	expect_only(0);
}

static void a_camera_slower_than_its_trigger_is_named_and_still_used(void **state)
{
	struct device device = {0};
	uint64_t taken = 0;

	(void)state;
	start();
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 120; shot += 2) {
		uint64_t found = take(&device, shot);

		assert_true(found == 0 || found == shot);
		taken += found != 0;
	}
	assert_int_equal(count(LEDGER_SLOWER_THAN_TRIGGER), 1);
	assert_true(ledger.cameras[0].slower);
	assert_in_range(taken, 56, 60);
	/* back at full speed */
	for (uint64_t shot = FIRST_SHOT + 120; shot < FIRST_SHOT + 160; shot++) {
		uint64_t found = take(&device, shot);

		assert_true(found == 0 || found == shot);
	}
	assert_false(ledger.cameras[0].slower);
}

static void a_camera_that_delivers_every_other_frame_is_slower(void **state)
{
	struct device device = {0};

	(void)state;
	start();
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 60; shot += 2, device.seq++)
		assert_int_equal(take(&device, shot), shot);
	expect_only(ONLY(LEDGER_DROPPED) | ONLY(LEDGER_SLOWER_THAN_TRIGGER));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_event_has_a_name),
		cmocka_unit_test(frames_in_step_make_no_event),
		cmocka_unit_test(jitter_at_the_margin_follows_the_counter),
		cmocka_unit_test(a_dropped_frame_is_counted_with_its_shot),
		cmocka_unit_test(a_repeated_frame_is_refused),
		cmocka_unit_test(a_repeat_that_the_device_counted_moves_nothing),
		cmocka_unit_test(a_late_frame_is_refused_and_those_behind_it_are_not),
		cmocka_unit_test(a_stamp_one_period_ahead_is_put_right_by_the_counter),
		cmocka_unit_test(a_stamp_one_period_behind_is_put_right_by_the_counter),
		cmocka_unit_test(a_stamp_made_on_late_arrival_is_refused_not_believed),
		cmocka_unit_test(a_missed_trigger_costs_three_frames_and_is_named),
		cmocka_unit_test(a_counter_that_jumps_is_not_followed),
		cmocka_unit_test(a_wrong_first_frame_is_outvoted_by_the_next_two),
		cmocka_unit_test(a_counter_that_begins_anew_is_taken_up),
		cmocka_unit_test(a_frozen_camera_has_missed_its_triggers),
		cmocka_unit_test(a_counter_that_wraps_in_64_bits_goes_on),
		cmocka_unit_test(a_camera_slower_than_its_trigger_is_named_and_still_used),
		cmocka_unit_test(a_camera_that_delivers_every_other_frame_is_slower),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
