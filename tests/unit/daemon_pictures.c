/*
 * Faults that neither counter nor time shows: the pictures do. With the real pictures, blobs and
 * tracker.
 */
#include "virtual_station.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

/* Nothing but `event`, once, at camera `camera`. */
static void expect_once(const struct station *station, uint32_t camera, enum ledger_event event)
{
	for (uint32_t c = 0; c < 4; c++)
		for (int e = 0; e < LEDGER_EVENT_COUNT; e++) {
			uint64_t count = virtual_station_events(station, c, (enum ledger_event)e);

			if (count != (c == camera && e == (int)event))
				fail_msg("camera %u: %s %d times", c,
					 ledger_event_name((enum ledger_event)e), (int)count);
		}
}

#define TALKING(faults) "trigger: sim\nsim: {scene: talking, faults: [" faults "]}\n"

static void a_stuck_exposure_is_named(void **state)
{
	struct station *station = virtual_station_start(
		"talking", 0, TALKING("{camera: ir1, kind: stuck_exposure, at_s: 1, for_s: 0.5}"));

	(void)state;
	virtual_station_run_to(station, 1.3);
	assert_true(atomic_load(&station->solver.book.cameras[1].overexposed));
	virtual_station_run_to(station, 1.7);
	assert_false(atomic_load(&station->solver.book.cameras[1].overexposed));
	expect_once(station, 1, LEDGER_OVEREXPOSED);
	virtual_station_end(station);
}

static void a_camera_bumped_by_a_fifth_of_a_milliradian_is_named(void **state)
{
	struct station *station = virtual_station_start(
		"talking", 0, TALKING("{camera: ir2, kind: bump, at_s: 0.1, angle_mrad: 0.2}"));

	(void)state;
	virtual_station_run_to(station, 2.3);
	expect_once(station, 2, LEDGER_MOVED);
	assert_true(atomic_load(&station->solver.book.cameras[2].moved));
	virtual_station_end(station);
}

static void faults_of_a_scene_file_befall_the_station(void **state)
{
	char path[] = "/tmp/stage-scene-XXXXXX.yaml", config[128];
	int fd = mkstemps(path, 5);

	(void)state;
	assert_true(fd >= 0);
	assert_true(dprintf(fd,
			    "title: t\nseconds: 5\nactors: [{name: a}]\n"
			    "faults: [{camera: ir3, kind: dark, at_s: 0.3, for_s: 0.3}]\n") > 0);
	close(fd);
	snprintf(config, sizeof(config), "trigger: sim\nsim: {scene: %s}\n", path);
	struct station *station = virtual_station_start(path, 0, config);

	virtual_station_run_to(station, 0.8);
	expect_once(station, 3, LEDGER_DARK);
	virtual_station_end(station);
	unlink(path);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(faults_of_a_scene_file_befall_the_station),
		cmocka_unit_test(a_stuck_exposure_is_named),
		cmocka_unit_test(a_camera_bumped_by_a_fifth_of_a_milliradian_is_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
