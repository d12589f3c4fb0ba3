/*
 * A camera whose images are one shot old, with nothing in counter or time to show it: the tracker's
 * residuals do. With the real pictures and the real tracker.
 */
#include "virtual_station.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void a_camera_one_shot_behind_without_a_trace_is_named(void **state)
{
	struct station *station = virtual_station_start(
		"turning", 0,
		"trigger: sim\nsim: {scene: turning, faults: [{camera: ir2, kind: shift, at_s: 1, "
		"for_s: 1.2}]}\n");

	(void)state;
	virtual_station_run_to(station, 0.95);
	for (uint32_t c = 0; c < 4; c++)
		assert_int_equal(virtual_station_events(station, c, LEDGER_OUT_OF_STEP), 0);
	virtual_station_run_to(station, 2.2);
	for (uint32_t c = 0; c < 4; c++)
		assert_int_equal(virtual_station_events(station, c, LEDGER_OUT_OF_STEP), c == 2);
	assert_true(atomic_load(&station->solver.book.cameras[2].out_of_step));
	virtual_station_end(station);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_camera_one_shot_behind_without_a_trace_is_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
