/*
 * The station with cameras that misbehave on command: what they lose is counted, and nobody else
 * waits for them.
 */
#include "daemon/station.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock_virtual.h"
#include "fake_cameras.h"
#include "sim/world/scene.h"

static char stage_dir[] = "/tmp/stage-test-XXXXXX";
static char config_path[PATH_MAX];

static void take_sets(struct station *station)
{
	struct pollfd poll_fd = {.fd = station->wake_fd, .events = POLLIN};
	eventfd_t ignored;

	poll(&poll_fd, 1, 1);
	eventfd_read(station->wake_fd, &ignored);
	while (station_next_set(station))
		station_pop_set(station);
}

/* Runs for a while of virtual time, as the control thread does: takes the sets, ticks now and then.
 */
static void run_for(struct station *station, int64_t duration_ns)
{
	int64_t end_ns = clock_virtual_limit() + duration_ns;

	while (clock_virtual_limit() < end_ns) {
		clock_virtual_set_limit(clock_virtual_limit() + 20 * NS_PER_MS);
		while (!clock_virtual_at_limit())
			take_sets(station);
		station_tick(station);
	}
}

static struct station *start_station(void)
{
	struct station *station = calloc(1, sizeof(*station));
	struct diag diag = {0};

	clock_virtual_begin(1000 * NS_PER_S, 1000 * NS_PER_S);
	for (int c = 0; c < CAMERA_COUNT; c++)
		fake_faults[c] = FAULT_NONE;
	assert_int_equal(station_load(station, config_path, &diag), EXIT_CODE_OK);
	assert_int_equal(station_configure(station, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_CONFIGURED);
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_RUNNING);
	run_for(station, 60 * NS_PER_MS);
	return station;
}

static void end_station(struct station *station)
{
	station_finish(station);
	assert_int_equal(station->state, STATION_IDLE);
	assert_int_equal(fake_open_count, 0);
	free(station);
	clock_virtual_end();
}

/* Shots solved in `duration_ns` while camera 1 has a fault. */
static uint64_t shots_with_fault(struct station *station, enum fault fault, int64_t duration_ns)
{
	uint64_t before = station->solver.shots;

	fake_faults[1] = fault;
	run_for(station, duration_ns);
	return station->solver.shots - before;
}

static void a_silent_camera_stalls_nobody(void **state)
{
	struct station *station = start_station();
	uint64_t shots = shots_with_fault(station, FAULT_SILENT, 600 * NS_PER_MS);

	(void)state;
	assert_in_range(shots, 45, 66);
	assert_in_range(station->captures[1].counters.missing, 40, 70);
	assert_in_range(station->captures[0].counters.missing, 0, 3);
	end_station(station);
}

static void a_camera_that_speaks_again_is_waited_for_again(void **state)
{
	struct station *station = start_station();

	(void)state;
	shots_with_fault(station, FAULT_SILENT, 300 * NS_PER_MS);
	shots_with_fault(station, FAULT_NONE, 100 * NS_PER_MS);
	uint64_t missing = station->captures[1].counters.missing;
	uint64_t shots = shots_with_fault(station, FAULT_NONE, 200 * NS_PER_MS);
	assert_in_range(shots, 10, 30);
	assert_in_range(station->captures[1].counters.missing - missing, 0, 1);
	end_station(station);
}

static void shots_begin_when_all_cameras_run(void **state)
{
	struct station *station = start_station();

	(void)state;
	assert_in_range(station->solver.shots, 1, 20);
	assert_int_equal(station->solver.incomplete, 0);
	end_station(station);
}

static void a_vanished_camera_comes_back_by_itself(void **state)
{
	struct station *station = start_station();
	uint64_t shots = shots_with_fault(station, FAULT_GONE, 200 * NS_PER_MS);

	(void)state;
	assert_in_range(shots, 10, 30);
	assert_int_equal(station->captures[1].state, CAPTURE_LOST);
	shots_with_fault(station, FAULT_NONE, 200 * NS_PER_MS);
	assert_int_equal(station->captures[1].state, CAPTURE_RUNNING);
	assert_int_equal(station->captures[1].counters.reopened, 1);
	uint64_t missing = station->captures[1].counters.missing;
	run_for(station, 200 * NS_PER_MS);
	assert_in_range(station->captures[1].counters.missing - missing, 0, 3);
	end_station(station);
}

static void every_lost_camera_says_since_when_and_why(void **state)
{
	struct station *station = start_station();
	int64_t before_ns = clock_now_ns();

	(void)state;
	fake_faults[2] = FAULT_GONE;
	shots_with_fault(station, FAULT_GONE, 200 * NS_PER_MS);
	for (int c = 1; c <= 2; c++) { /* the second is tried although the first stays away */
		assert_in_range(station->captures[c].lost_since_ns, before_ns, clock_now_ns());
		assert_non_null(strstr(station->captures[c].lost_why, "not there: plug it in"));
	}
	fake_faults[2] = FAULT_NONE;
	run_for(station, 200 * NS_PER_MS);
	assert_int_equal(station->captures[1].state, CAPTURE_LOST);
	assert_int_equal(station->captures[2].state, CAPTURE_RUNNING);
	assert_int_equal(station->captures[2].lost_since_ns, 0);
	end_station(station);
}

static void it_starts_and_stops_again_and_again(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	for (uint32_t run = 2; run < 6; run++) {
		assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_RUNNING);
		assert_true(station_stop(station));
		assert_false(station_stop(station));
		assert_int_equal(station->state, STATION_CONFIGURED);
		while (station_next_set(station))
			station_pop_set(station);
		assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
		run_for(station, 100 * NS_PER_MS);
		const struct marker_set *set = station_next_set(station);
		uint64_t shots = station->solver.shots;
		assert_in_range(shots, 2, 12); /* of this run alone */
		assert_int_equal(station->solver.incomplete, 0);
		assert_int_equal(station->run, run);
		if (set)
			assert_int_equal(set->run, run);
	}
	diag_finish(&diag);
	end_station(station);
}

static void calibrating_captures_without_solving(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_RUNNING);
	station_stop(station);
	while (station_next_set(station))
		station_pop_set(station);
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_CALIBRATING);
	capture_request_preview(&station->captures[1]);
	run_for(station, 150 * NS_PER_MS);
	assert_int_equal(station->captures[1].preview.state, PREVIEW_READY);
	assert_true(station->captures[1].counters.frames > 5);
	assert_true(station->solver.shots > 5);
	assert_null(station_next_set(station));
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_RUNNING);
	assert_true(station_stop(station));
	diag_finish(&diag);
	end_station(station);
}

static void a_camera_that_went_away_while_stopped_is_lost_and_comes_back(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	station_stop(station);
	fake_faults[3] = FAULT_GONE;
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	assert_int_equal(station->captures[3].state, CAPTURE_LOST);
	assert_non_null(strstr(station->captures[3].lost_why, "does not start"));
	run_for(station, 100 * NS_PER_MS);
	station_stop(station);
	assert_int_equal(station->captures[3].state, CAPTURE_LOST);
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	fake_faults[3] = FAULT_NONE;
	run_for(station, 200 * NS_PER_MS);
	assert_int_equal(station->captures[3].state, CAPTURE_RUNNING);
	diag_finish(&diag);
	end_station(station);
}

static void the_end_of_all_recordings_leaves_the_station_up(void **state)
{
	struct station *station = start_station();

	(void)state;
	for (int c = 0; c < CAMERA_COUNT; c++)
		fake_faults[c] = FAULT_OVER;
	run_for(station, 150 * NS_PER_MS);
	assert_int_equal(station->state, STATION_ENDED);
	assert_int_equal(station->captures[0].state, CAPTURE_ENDED);
	end_station(station);
}

static void every_loss_is_counted_by_its_cause(void **state)
{
	struct station *station = start_station();
	struct capture_counters *counters = &station->captures[1].counters;

	(void)state;
	shots_with_fault(station, FAULT_DAMAGED, 100 * NS_PER_MS);
	assert_in_range(counters->damaged, 4, 20);
	shots_with_fault(station, FAULT_FOREIGN_CLOCK, 100 * NS_PER_MS);
	assert_in_range(counters->wrong_time, 4, 20);
	shots_with_fault(station, FAULT_OTHER_SIZE, 100 * NS_PER_MS);
	assert_in_range(counters->wrong_size, 4, 20);
	/* the damaged ones never came with a number, so they are gaps too */
	uint64_t gaps = counters->device_gaps;
	shots_with_fault(station, FAULT_GAPS, 200 * NS_PER_MS);
	assert_in_range(counters->device_gaps - gaps, 5, 20);
	_Atomic uint64_t *repeated = &station->solver.book.cameras[1].counts[LEDGER_REPEATED];
	uint64_t repeats = *repeated;
	shots_with_fault(station, FAULT_REPEAT, 100 * NS_PER_MS);
	assert_in_range(*repeated - repeats, 4, 20);
	end_station(station);
}

static void one_camera_that_is_not_there_leaves_none_open(void **state)
{
	struct station *station = calloc(1, sizeof(*station));
	struct diag diag = {0};

	(void)state;
	fake_faults[2] = FAULT_GONE;
	assert_int_equal(station_load(station, config_path, &diag), EXIT_CODE_OK);
	assert_int_equal(station_configure(station, &diag), EXIT_CODE_DEVICE);
	assert_non_null(strstr(diag.text, "fake:2"));
	assert_int_equal(fake_open_count, 0);
	assert_int_equal(station->state, STATION_IDLE);
	diag_finish(&diag);
	free(station);
}

static void a_station_that_nobody_listens_to_keeps_the_oldest_sets(void **state)
{
	struct station *station = start_station();
	uint64_t lost = station->solver.lost;

	(void)state;
	clock_rush_begin(); /* the control thread hangs */
	clock_sleep_until(clock_now_ns() + 600 * NS_PER_MS);
	clock_rush_end();
	assert_true(station->solver.lost > lost);
	assert_in_range(ring_count(&station->solver.sets), 32, 64);
	const struct marker_set *set = station_next_set(station);
	uint64_t first = set->shot;
	station_pop_set(station);
	assert_int_equal(station_next_set(station)->shot, first + 1);
	end_station(station);
}

static void assert_holds(const struct ring *ring, int64_t period_ns)
{
	assert_true(ring->capacity * period_ns >= 250 * NS_PER_MS);
}

static void queues_hold_a_quarter_of_a_second_also_of_cameras_that_run_faster(void **state)
{
	(void)state;
	fake_period_ns = PERIOD_NS / 2;
	struct station *station = start_station();
	fake_period_ns = 0;
	for (int c = 0; c < CAMERA_COUNT; c++)
		assert_holds(&station->captures[c].sets, PERIOD_NS / 2);
	assert_holds(&station->solver.sets, PERIOD_NS / 2);
	end_station(station);
}

static int make_stage(void **state)
{
	const char *addresses[CAMERA_COUNT] = {"fake:0", "fake:1", "fake:2", "fake:3"};
	struct sim_options options = {.camera_count = CAMERA_COUNT, .rate_hz = 100};
	struct sim_scene *scene;
	struct diag diag = {0};

	(void)state;
	if (!mkdtemp(stage_dir) || sim_scene_create(&scene, &options, &diag) < 0)
		return -1;
	int err = sim_scene_write_stage(scene, stage_dir, addresses,
					"calibration: {rate_hz: 120}\n", &diag);
	sim_scene_destroy(scene);
	snprintf(config_path, sizeof(config_path), "%s/stage.yaml", stage_dir);
	diag_finish(&diag);
	return err;
}

static int remove_stage(void **state)
{
	char command[PATH_MAX];

	(void)state;
	snprintf(command, sizeof(command), "rm -r %s", stage_dir);
	return system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_silent_camera_stalls_nobody),
		cmocka_unit_test(a_camera_that_speaks_again_is_waited_for_again),
		cmocka_unit_test(shots_begin_when_all_cameras_run),
		cmocka_unit_test(a_vanished_camera_comes_back_by_itself),
		cmocka_unit_test(every_lost_camera_says_since_when_and_why),
		cmocka_unit_test(it_starts_and_stops_again_and_again),
		cmocka_unit_test(calibrating_captures_without_solving),
		cmocka_unit_test(a_camera_that_went_away_while_stopped_is_lost_and_comes_back),
		cmocka_unit_test(the_end_of_all_recordings_leaves_the_station_up),
		cmocka_unit_test(every_loss_is_counted_by_its_cause),
		cmocka_unit_test(one_camera_that_is_not_there_leaves_none_open),
		cmocka_unit_test(queues_hold_a_quarter_of_a_second_also_of_cameras_that_run_faster),
		cmocka_unit_test(a_station_that_nobody_listens_to_keeps_the_oldest_sets),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_stage, remove_stage);
}
