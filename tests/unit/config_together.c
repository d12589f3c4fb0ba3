/*
 * What keys of the configuration mean for each other, for the simulator and for the drivers.
 */
#include "config/config.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "one_config.h"

static void settings_that_contradict_each_other_are_refused(void **state)
{
	(void)state;
	expect_messages(
		HEAD CAMERAS "exposure_us: 9000\n",
		"6:14: exposure_us: 9000 us does not fit between two shots, which are 8333.33 us "
		"apart; lower it or the rate\n");
	expect_messages(HEAD CAMERAS "blobs: {area_min_px: 50, area_max_px: 20}\n",
			"6:9: blobs.area_max_px: 20 is below area_min_px, which is 50\n");
	expect_messages(HEAD CAMERAS "tracking: {range_min_m: 5, range_max_m: 5}\n",
			"6:12: tracking.range_max_m: 5 is not above range_min_m, which is 5\n");
	expect_messages(HEAD CAMERAS
			"exposure_us: 200\nstrobe_delay_us: 150\nstrobe_width_us: 100\n",
			"7:18: strobe_delay_us: the strobe burns 150 to 250 us after the edge, "
			"outside the exposure, which is open 0 to 200 us; move or shorten the "
			"strobe\n");
	expect_messages(HEAD CAMERAS "strobe_delay_us: 400\n",
			"6:18: strobe_delay_us: the strobe burns 400 to 650 us after the edge, "
			"outside the exposure, which is open 0 to 250 us; move or shorten the "
			"strobe\n");
	expect_messages(HEAD CAMERAS "strobe_width_us: 500\n",
			"6:18: strobe_delay_us: the strobe burns 0 to 500 us after the edge, "
			"outside the exposure, which is open 0 to 250 us; move or shorten the "
			"strobe\n");
	expect_messages(HEAD CAMERAS "strobe_width_us: 240\nstrobe_duty_max: 0.02\n",
			"6:18: strobe_width_us: 240 us of every 8333.33 us overheats a strobe that "
			"may burn 0.02 of the time; give at most 166.667 us, or lower the rate\n");
	expect_messages(
		HEAD CAMERAS "hd: {divider: 0, phase: 1}\n",
		"6:15: hd.divider: HD cameras cannot take every 0-th shot; give 1 to 1000, 4 "
		"for 30 Hz beside 120 Hz\n");
	expect_messages(
		HEAD CAMERAS "hd:\n  phase: 4\n",
		"7:10: hd.phase: 4 is not a shot of the 4 that an HD frame comes in; give 0 "
		"to 3\n");
	expect_messages(
		HEAD CAMERAS "ir_delay_us: -3\n",
		"6:14: ir_delay_us: -3 is out of range, expected a number from 0 to 1000000 "
		"(microseconds)\n");
}

#define SIM_CAMERAS                                     \
	"cameras:\n- {name: ir1, address: 'sim:ir7'}\n" \
	"- {name: ir2, address: 'files:take/ir2'}\n"

static void faults_of_the_simulator_are_read_as_data(void **state)
{
	const struct sim_fault *fault = &config.sim_faults.faults[1];

	(void)state;
	assert_int_equal(load(HEAD SIM_CAMERAS
			      "sim:\n  faults:\n  - {camera: ir1, kind: unplug}\n"
			      "  - {camera: ir1, kind: delay, at_s: 5, for_s: 2.5, every: 10, "
			      "delay_ms: 12}\n",
			      NULL),
			 0);
	assert_int_equal(config.sim_faults.count, 2);
	assert_int_equal(config.sim_faults.faults[0].kind, SIM_FAULT_UNPLUG);
	assert_int_equal(fault->kind, SIM_FAULT_DELAY);
	assert_string_equal(fault->device, "ir7");
	assert_float_equal(fault->at_s, 5, 0);
	assert_float_equal(fault->for_s, 2.5, 0);
	assert_float_equal(fault->delay_ms, 12, 0);
	assert_int_equal(fault->every, 10);
}

static void faults_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_messages(
		HEAD SIM_CAMERAS "sim:\n  faults:\n"
				 "  - {camera: ir9, kind: drop}\n"
				 "  - {camera: ir2, kind: drop}\n"
				 "  - {camera: ir1, kind: phase_slip}\n"
				 "  - {camera: ir1, kind: melt}\n"
				 "  - {camera: ir1, kind: drop, at_s: -1}\n"
				 "  - {kind: drop}\n",
		"11:25: sim.faults[3].kind: 'melt' is unknown, expected drop or miss or delay "
		"or repeat or shift or stamp_shift or freeze or unplug or dark or phase_slip or "
		"stuck_exposure or bump or clock_step or slow_disk or strobe_leak\n"
		"12:37: sim.faults[4].at_s: -1 is out of range, expected a number from 0 to "
		"1000000 (seconds)\n"
		"13:6: sim.faults[5].camera: missing\n"
		"8:6: sim.faults[0].camera: there is no camera 'ir9'\n"
		"9:6: sim.faults[1].camera: camera 'ir2' is a recording: of its faults only "
		"slow_disk can be made\n"
		"10:6: sim.faults[2].camera: camera 'ir1' has no phase to slip from: it is no "
		"HD camera\n");
}

static void no_such_camera(const char *address, struct diag *diag)
{
	if (strncmp(address, "files:", 6) != 0)
		diag_add(diag, "no driver of %s", address);
}

static void no_such_trigger(const struct config *made, bool plans_are_good, struct diag *diag)
{
	diag_add(diag, "no %s, plans %s", made->trigger, plans_are_good ? "good" : "bad");
	if (plans_are_good)
		diag_add(diag, "and its plan does not fit");
}

static void drivers_are_asked_beside_all_else_that_is_wrong(void **state)
{
	static const struct config_drivers drivers = {no_such_camera, no_such_trigger};
	static const char *const good = HEAD CAMERAS "trigger: laser\n";
	static const char *const bad = HEAD CAMERAS "trigger: laser\nrate_hz: 0\n";
	struct diag diag = {0};

	(void)state;
	write_file(good, strlen(good));
	assert_int_equal(config_load_for(&config, path, &drivers, &diag), -EINVAL);
	expect_lines(&diag, "6:10: trigger: no laser, plans good\n"
			    "6:10: trigger: and its plan does not fit\n"
			    "4:4: cameras[0].address: no driver of aravis:192.168.1.7\n");
	write_file(bad, strlen(bad));
	assert_int_equal(config_load_for(&config, path, &drivers, &diag), -EINVAL);
	expect_lines(&diag, "7:10: rate_hz: 0 is out of range, expected a number from 1 to 1000 "
			    "(hertz)\n"
			    "6:10: trigger: no laser, plans bad\n"
			    "4:4: cameras[0].address: no driver of aravis:192.168.1.7\n");
}

static void an_exposure_longer_than_its_camera_s_period_is_refused(void **state)
{
	(void)state;
	expect_messages(HEAD "rate_hz: 60\ncameras:\n"
			     "- {name: a, address: \"v4l2:x\", exposure_us: 1000000}\n"
			     "- {name: b, address: \"v4l2:y\", role: hd, exposure_us: 50000}\n"
			     "- {name: c, address: \"v4l2:z\", role: hd, exposure_us: 90000}\n",
			"5:4: cameras[0].exposure_us: 1e+06 us does not fit between two pictures, "
			"which are 16666.7 us apart; lower it or the rate\n"
			"7:4: cameras[2].exposure_us: 90000 us does not fit between two pictures, "
			"which are 66666.7 us apart; lower it or the rate\n");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(settings_that_contradict_each_other_are_refused),
		cmocka_unit_test(faults_of_the_simulator_are_read_as_data),
		cmocka_unit_test(faults_that_cannot_be_are_refused),
		cmocka_unit_test(drivers_are_asked_beside_all_else_that_is_wrong),
		cmocka_unit_test(an_exposure_longer_than_its_camera_s_period_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
