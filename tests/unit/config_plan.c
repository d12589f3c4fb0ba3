/*
 * The trigger plans that a configuration makes: of the running station and of a calibration.
 */
#include "config/config.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "drivers/trigger_plan.h"
#include "one_config.h"

static void the_whole_trigger_plan_can_be_given(void **state)
{
	(void)state;
	assert_int_equal(load(HEAD CAMERAS
			      "exposure_us: 400\nir_delay_us: 20\nstrobe_delay_us: 50\n"
			      "strobe_width_us: 300\nstrobe_duty_max: 0.05\n"
			      "hd: {divider: 2, phase: 1, delay_us: 100, exposure_us: 5000}\n",
			      NULL),
			 0);
	assert_int_equal(config.plan.ir_exposure_ns, 400000);
	assert_int_equal(config.plan.ir_delay_ns, 20000);
	assert_int_equal(config.plan.strobe_delay_ns, 50000);
	assert_int_equal(config.plan.strobe_width_ns, 300000);
	assert_float_equal(config.plan.strobe_duty_max, 0.05, 0);
	assert_int_equal(config.plan.hd_divider, 2);
	assert_int_equal(config.plan.hd_phase, 1);
	assert_int_equal(config.plan.hd_delay_ns, 100000);
	assert_int_equal(config.plan.hd_exposure_ns, 5000000);
}

static void a_strobe_not_given_burns_as_long_as_it_safely_can(void **state)
{
	(void)state;
	assert_int_equal(load(HEAD CAMERAS "exposure_us: 5000\nir_delay_us: 10\n", NULL), 0);
	assert_int_equal(config.plan.strobe_delay_ns, 10000);
	assert_int_equal(config.plan.strobe_width_ns, 833333);
}

static void a_calibration_is_lit_long_and_all_cameras_at_once(void **state)
{
	const struct trigger_plan *plan = &config.calibration_plan;

	(void)state;
	assert_int_equal(load(HEAD CAMERAS "ir_delay_us: 20\nstrobe_duty_max: 0.02\n"
					   "calibration: {rate_hz: 10, exposure_us: 3000}\n",
			      NULL),
			 0);
	assert_int_equal(plan->period_ns, 12 * config.plan.period_ns);
	assert_int_equal(plan->ir_exposure_ns, 3000000);
	assert_int_equal(plan->strobe_width_ns, 1999999); /* a fiftieth of the period */
	assert_int_equal(plan->hd_divider, 1);
	assert_in_range(trigger_plan_hd_middle_ns(plan) - trigger_plan_ir_middle_ns(plan) + 1, 0,
			2);
}

static void a_calibration_without_strobe_stays_so(void **state)
{
	(void)state;
	assert_int_equal(load(HEAD CAMERAS "strobe_width_us: 0\n", NULL), 0);
	assert_int_equal(config.calibration_plan.strobe_width_ns, 0);
	assert_int_equal(config.calibration_plan.ir_exposure_ns, 2000000);
	assert_int_equal(config.calibration_plan.period_ns, 10 * config.plan.period_ns);
}

static void a_calibration_that_cannot_be_lit_is_refused(void **state)
{
	(void)state;
	expect_messages(HEAD CAMERAS "calibration: {rate_hz: 100, exposure_us: 20000}\n",
			"6:15: calibration: 20000 us does not fit between two shots, which are "
			"8333.33 us apart; lower it or the rate\n"
			"6:15: calibration: 4000 us, begun 8000 us after the edge, ends after the "
			"next of the HD frames, which are 8333.33 us apart; shorten it or its "
			"delay\n");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_whole_trigger_plan_can_be_given),
		cmocka_unit_test(a_strobe_not_given_burns_as_long_as_it_safely_can),
		cmocka_unit_test(a_calibration_is_lit_long_and_all_cameras_at_once),
		cmocka_unit_test(a_calibration_without_strobe_stays_so),
		cmocka_unit_test(a_calibration_that_cannot_be_lit_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
