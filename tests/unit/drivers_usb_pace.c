/*
 * The pace of a USB trigger, against an adapter that is made up here: its quartz is off, and what
 * it takes is seen late, by a little mostly and by a lot sometimes.
 */
#include "drivers/usb/usb_pace.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/rng.h"

#define PERIOD_NS (NS_PER_S / 120)
#define LEAD_SHOTS 38
#define START_NS (1000 * NS_PER_S)
#define HOLDS 1024 /* samples that the adapter takes ahead */

static const struct trigger_plan plan = {
	.period_ns = PERIOD_NS,
	.ir_exposure_ns = 400 * NS_PER_US,
	.strobe_width_ns = 250 * NS_PER_US,
	.hd_divider = 4,
};

static struct world {
	struct usb_wave wave;
	struct usb_pace pace;
	struct rng rng;
	double rate;                      /* of its quartz, 1 when that is right */
	int64_t first_ns, first_sample;   /* truth */
	int64_t begun_at[LEAD_SHOTS + 1]; /* first samples of the shots on their way */
	int64_t due_ns[LEAD_SHOTS + 1];
	uint64_t shot;
} world;

/* When a sample is on the lines, in truth. */
static int64_t truth_ns(int64_t sample)
{
	double passed_ns = (double)(sample - world.first_sample) * world.wave.divisor * 50 / 3;

	return world.first_ns + (int64_t)(passed_ns / world.rate);
}

static int64_t seen_late_ns(void)
{
	double u = rng_uniform(&world.rng);

	return 60 * NS_PER_US + (int64_t)(u * u * 200e3) +
	       (rng_uniform(&world.rng) < 0.02 ? 5 * NS_PER_MS : 0);
}

static void begin(double drift_ppm)
{
	const uint8_t bits[PULSE_LINE_COUNT] = {1, 2, 4};

	memset(&world, 0, sizeof(world));
	rng_init(&world.rng, 7, 0);
	assert_int_equal(usb_wave_make(&world.wave, &plan, bits, 512, "trigger usb", NULL), 0);
	world.rate = 1 + drift_ppm * 1e-6;
	world.first_ns = START_NS;
	usb_pace_begin(&world.pace, &world.wave, PERIOD_NS, 0, START_NS - 50 * NS_PER_US,
		       START_NS + 120 * NS_PER_US);
	usb_pace_seek(&world.pace, 40000);
}

/* A shot is sent; the one LEAD_SHOTS before it is taken. Returns what the pace says of that. */
static bool play_shot(void)
{
	uint64_t slot = world.shot++ % LEAD_SHOTS;
	bool good = true;

	if (world.shot > LEAD_SHOTS) {
		int64_t end = world.begun_at[slot] + 16 * (int64_t)512;

		good = usb_pace_taken(&world.pace, end, truth_ns(end - HOLDS) + seen_late_ns());
	}
	world.begun_at[slot] = world.pace.shot_sample;
	world.due_ns[slot] = world.pace.due_ns;
	usb_pace_advance(&world.pace);
	return good;
}

static void shots_keep_to_the_clock_whatever_the_quartz_does(void **state)
{
	const double drifts_ppm[] = {-100, -30, 0, 45, 100};

	(void)state;
	for (size_t d = 0; d < sizeof(drifts_ppm) / sizeof(drifts_ppm[0]); d++) {
		begin(drifts_ppm[d]);
		for (int i = 0; i < 120 * 60; i++) {
			int64_t off_ns = truth_ns(world.pace.shot_sample) - world.pace.due_ns;

			if (i > 120 * 10 && llabs(off_ns) > 150 * NS_PER_US)
				fail_msg("drift %g: shot %d is %ld ns off", drifts_ppm[d], i,
					 (long)off_ns);
			assert_true(play_shot());
		}
	}
}

static void times_of_shots_are_within_their_bound(void **state)
{
	const double drifts_ppm[] = {-80, 20, 100};
	int64_t last_bound_ns = 0;

	(void)state;
	for (size_t d = 0; d < sizeof(drifts_ppm) / sizeof(drifts_ppm[0]); d++) {
		begin(drifts_ppm[d]);
		for (int i = 0; i < 120 * 30; i++) {
			int64_t sample, off_ns;

			assert_true(play_shot());
			sample = world.begun_at[world.shot % LEAD_SHOTS]; /* the oldest */
			if (world.shot <= LEAD_SHOTS)
				continue;
			off_ns = usb_pace_host_ns(&world.pace, sample, &last_bound_ns) -
				 truth_ns(sample);
			if (llabs(off_ns) > last_bound_ns)
				fail_msg("shot %d is %ld ns off, told %ld", i, (long)off_ns,
					 (long)last_bound_ns);
		}
		assert_true(last_bound_ns < NS_PER_MS);
	}
}

static void shots_differ_by_a_few_samples_only(void **state)
{
	int64_t before = 0;

	(void)state;
	begin(100);
	for (int i = 0; i < 120 * 30; i++) {
		int64_t length = world.pace.shot_sample - before;

		if (i)
			assert_in_range(length, world.wave.period - world.wave.slack,
					world.wave.period + world.wave.slack);
		before = world.pace.shot_sample;
		play_shot();
	}
	assert_true(world.wave.slack <= 3);
}

static void adapter_that_stood_still_is_noticed(void **state)
{
	int shots = 0;

	(void)state;
	begin(30);
	for (int i = 0; i < 120 * 5; i++)
		assert_true(play_shot());
	world.first_ns += 4 * NS_PER_MS;
	while (play_shot() && shots < 1000)
		shots++;
	assert_in_range(shots, 16, 120);
}

static void machine_that_stood_still_is_no_underrun(void **state)
{
	(void)state;
	begin(30);
	for (int i = 0; i < 120 * 20; i++) {
		assert_true(play_shot());
		if (i % 200 == 0) { /* all of 200 ms are seen at once */
			int64_t until_ns = truth_ns(world.pace.shot_sample);

			for (int k = 0; k < 24; k++) {
				int64_t end = world.begun_at[world.shot % LEAD_SHOTS] + 16 * 512;
				int64_t late_ns =
					until_ns > truth_ns(end) ? until_ns : truth_ns(end);

				assert_true(usb_pace_taken(&world.pace, end, late_ns));
				world.begun_at[world.shot++ % LEAD_SHOTS] = world.pace.shot_sample;
				usb_pace_advance(&world.pace);
			}
		}
	}
}

/* Shots that nobody could fire are left out by number; the rest are on the same grid. */
static void next_stream_goes_on_with_the_shots_by_their_time(void **state)
{
	(void)state;
	begin(60);
	for (int i = 0; i < 120 * 12; i++)
		play_shot();
	uint64_t shot = world.pace.shot;
	int64_t due_ns = world.pace.due_ns, dead_ns = 700 * NS_PER_MS + 1234567;
	int64_t sample = world.pace.shot_sample;

	world.first_ns = truth_ns(sample) + dead_ns;
	world.first_sample = sample;
	usb_pace_begin(&world.pace, &world.wave, PERIOD_NS, sample, world.first_ns - 100000,
		       world.first_ns + 90000);
	usb_pace_seek(&world.pace, sample + 30000);
	uint64_t passed = world.pace.shot - shot;

	assert_int_equal(world.pace.due_ns, due_ns + (int64_t)passed * PERIOD_NS);
	assert_in_range(passed, 700 / 9 + 1, 900 / 8);
	assert_true(llabs(truth_ns(world.pace.shot_sample) - world.pace.due_ns) < 200 * NS_PER_US);
	assert_in_range(world.pace.shot_sample, sample + 30000, sample + 30000 + 8400);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(shots_keep_to_the_clock_whatever_the_quartz_does),
		cmocka_unit_test(times_of_shots_are_within_their_bound),
		cmocka_unit_test(shots_differ_by_a_few_samples_only),
		cmocka_unit_test(adapter_that_stood_still_is_noticed),
		cmocka_unit_test(machine_that_stood_still_is_no_underrun),
		cmocka_unit_test(next_stream_goes_on_with_the_shots_by_their_time),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
