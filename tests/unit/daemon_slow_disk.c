/*
 * A recording whose disk stalls, in real time: the station goes on without it and names it late.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "daemon/station.h"
#include "sim/record.h"

#define RATE_HZ 30
#define SECONDS 0.4

static char dir[] = "/tmp/stage-slow-XXXXXX";

static int record(void **state)
{
	const struct sim_options options = {.scene = "rest", .seed = 1, .rate_hz = RATE_HZ};
	char path[64];

	(void)state;
	if (!mkdtemp(dir) || sim_record(&options, dir, SECONDS, NULL, NULL, NULL))
		return -1;
	snprintf(path, sizeof(path), "%s/stage.yaml", dir);
	FILE *config = fopen(path, "a");

	if (!config)
		return -1;
	fputs("sim: {faults: [{camera: ir1, kind: slow_disk, at_s: 0.12, for_s: 0.03, "
	      "delay_ms: 300}]}\n",
	      config);
	return fclose(config);
}

static int remove_recording(void **state)
{
	char command[64];

	(void)state;
	snprintf(command, sizeof(command), "rm -r %s", dir);
	return system(command);
}

static void take_sets(struct station *station)
{
	while (station_next_set(station))
		station_pop_set(station);
	station_tick(station);
}

static void a_slow_disk_makes_its_camera_late(void **state)
{
	static struct station station;
	struct diag diag = {0};
	char path[64];

	(void)state;
	snprintf(path, sizeof(path), "%s/stage.yaml", dir);
	assert_int_equal(station_load(&station, path, &diag), EXIT_CODE_OK);
	assert_int_equal(station_configure(&station, &diag), EXIT_CODE_OK);
	assert_int_equal(station_start(&station, STATION_START, &diag), EXIT_CODE_OK);
	const struct camera_events *events = station.solver.book.cameras;
	int64_t deadline_ns = clock_now_ns() + 20 * NS_PER_S;

	while (!atomic_load(&events[1].counts[LEDGER_LATE]) && clock_now_ns() < deadline_ns) {
		take_sets(&station);
		usleep(5000);
	}
	assert_true(atomic_load(&events[1].counts[LEDGER_LATE]) > 0);
	assert_true(atomic_load(&station.captures[1].counters.missing) > 0);
	assert_int_equal(atomic_load(&events[0].counts[LEDGER_LATE]), 0);
	station_finish(&station);
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_slow_disk_makes_its_camera_late),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, record, remove_recording);
}
