/*
 * What the station encodes of its statistics is what a subscriber decodes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <stdlib.h>

#include "protocol/decode.h"
#include "protocol/encode.h"

static int set_up(void **state)
{
	return decoder_create((struct decoder **)state);
}

static int tear_down(void **state)
{
	decoder_destroy(*state);
	return 0;
}

/* The decoder's, until the next. */
static const struct stage_statistics *send(struct decoder *decoder,
					   const struct stream_statistics *statistics)
{
	struct stage_event event;
	uint8_t *frame;
	size_t size_bytes;

	assert_int_equal(encode_statistics(statistics, &frame, &size_bytes), 0);
	assert_int_equal(decode_message(decoder, frame + FRAME_HEADER_BYTES,
					size_bytes - FRAME_HEADER_BYTES, &event),
			 0);
	free(frame);
	assert_int_equal(event.kind, STAGE_STATISTICS);
	return event.statistics;
}

static const struct stream_statistics SENT = {
	.time_ns = 5,
	.state = "running",
	.run = 3,
	.shots_per_s = 119.5,
	.shots_solved = 1000,
	.shots_incomplete = 7,
	.shots_lost = 2,
	.sim_late = 1,
	.edges_refused = 6,
	.sets = {1, 12, 64},
	.camera_count = 2,
	.latency_count = 1,
	.cameras = {{.state = "running",
		     .frames = 999,
		     .missing = 7,
		     .blobs_masked = 21,
		     .reopened = 3,
		     .queue = {0, 3, 64},
		     .moved_px = 0.3,
		     .moved_mrad = 0.2,
		     .loss_count = 3,
		     .losses = {{"damaged", 0}, {"stale", 4}, {"refused", 3}},
		     .event_count = 1,
		     .events = {{"late", 9}}},
		    {.state = "lost"}},
	.latencies = {{"light_to_sent", {10, 1, 2, 3, 4}, {5, 6, 7, 8, 9}}},
	.has_pulses = true,
	.pulses = {.lost = true,
		   .missed = 17,
		   .reopened = 2,
		   .late = {100, 11, 12, 13, 14},
		   .event_count = 2,
		   .events = {{"strobe_short", 0}, {"guard_cut", 5}}},
	.stall_count = 2,
	.stalls = {{"solver", 1100000000}, {"ir2", 2}},
	.has_unnamed = true,
	.unnamed = {12.5, 61, 0.4, 0.2, "cameras are swapped"},
};

static void check_cameras(const struct stage_statistics *got)
{
	assert_int_equal(got->camera_count, 2);
	assert_int_equal(got->cameras[0].loss_count, 2); /* those that are not 0 */
	assert_string_equal(got->cameras[0].losses[1].cause, "refused");
	assert_int_equal(got->cameras[0].losses[1].count, 3);
	assert_string_equal(got->cameras[0].events[0].cause, "late");
	assert_int_equal(got->cameras[0].queue.capacity, 64);
	assert_int_equal(got->cameras[0].blobs_masked, 21);
	assert_int_equal(got->cameras[0].reopened, 3);
	assert_true(got->cameras[0].moved_px == 0.3 && got->cameras[0].moved_mrad == 0.2);
	assert_string_equal(got->cameras[1].state, "lost");
}

static void check_pulses(const struct stage_pulses *got)
{
	assert_true(got->lost);
	assert_int_equal(got->missed, 17);
	assert_int_equal(got->reopened, 2);
	assert_int_equal(got->late.p99_ns, 13);
	assert_int_equal(got->event_count, 1);
	assert_string_equal(got->events[0].cause, "guard_cut");
}

static void check_unnamed(const struct stage_unnamed *got)
{
	assert_true(got->seconds == 12.5 && got->spots == 61);
	assert_true(got->points == 0.4 && got->named == 0.2);
	assert_string_equal(got->remedy, "cameras are swapped");
}

static void statistics_survive_the_wire(void **state)
{
	const struct stage_statistics *got = send(*state, &SENT);

	assert_string_equal(got->state, "running");
	assert_int_equal(got->run, 3);
	assert_true(got->shots_per_s == 119.5);
	assert_int_equal(got->shots_solved, 1000);
	assert_int_equal(got->shots_incomplete, 7);
	assert_int_equal(got->shots_lost, 2);
	assert_int_equal(got->sim_late, 1);
	assert_int_equal(got->edges_refused, 6);
	assert_int_equal(got->sets.filled_max, 12);
	check_cameras(got);
	assert_string_equal(got->latencies[0].stage, "light_to_sent");
	assert_int_equal(got->latencies[0].run.p99_ns, 3);
	assert_int_equal(got->latencies[0].recent.max_ns, 9);
	check_pulses(got->pulses);
	assert_int_equal(got->stall_count, 2);
	assert_string_equal(got->stalls[0].thread, "solver");
	assert_int_equal(got->stalls[0].still_ns, 1100000000);
	assert_string_equal(got->stalls[1].thread, "ir2");
	check_unnamed(got->unnamed);
}

static void statistics_of_a_station_with_names_say_nothing_of_them(void **state)
{
	static const struct stream_statistics fine = {.state = "running"};

	assert_null(send(*state, &fine)->unnamed);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(statistics_survive_the_wire, set_up, tear_down),
		cmocka_unit_test_setup_teardown(
			statistics_of_a_station_with_names_say_nothing_of_them, set_up, tear_down),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
