/*
 * A trigger plan that cannot be is refused with the reason and the remedy.
 */
#include "drivers/trigger_plan.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"

static struct trigger_plan good_plan(void)
{
	return (struct trigger_plan){.period_ns = NS_PER_S / 120,
				     .ir_delay_ns = 50 * NS_PER_US,
				     .ir_exposure_ns = 300 * NS_PER_US,
				     .strobe_delay_ns = 100 * NS_PER_US,
				     .strobe_width_ns = 200 * NS_PER_US,
				     .hd_divider = 4,
				     .hd_phase = 1,
				     .hd_delay_ns = 1 * NS_PER_MS,
				     .hd_exposure_ns = 4 * NS_PER_MS};
}

/* Exactly one message, and it says all of `words`. */
static void expect_refused(const struct trigger_plan *plan, const char *const *words)
{
	struct diag diag = {0};

	assert_int_equal(trigger_plan_check(plan, "usb", &diag), -EINVAL);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "trigger usb: the plan's "));
	for (int i = 0; words[i]; i++)
		if (!strstr(diag.text, words[i]))
			fail_msg("'%s' is not in: %s", words[i], diag.text);
	diag_finish(&diag);
}

#define EXPECT_REFUSED(plan, ...) expect_refused(plan, (const char *const[]){__VA_ARGS__, NULL})

static void a_plan_that_can_be_passes_in_silence(void **state)
{
	struct trigger_plan plan = good_plan();
	struct diag diag = {0};

	(void)state;
	assert_int_equal(trigger_plan_check(&plan, "usb", &diag), 0);
	plan.strobe_width_ns = 0; /* no strobe */
	assert_int_equal(trigger_plan_check(&plan, "usb", &diag), 0);
	assert_int_equal(diag.count, 0);
}

static void an_exposure_longer_than_the_period_is_refused(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	plan.ir_exposure_ns = 9 * NS_PER_MS;
	EXPECT_REFUSED(&plan, "exposure", "9000 us does not fit", "8333.33 us apart", "lower");
	plan.ir_exposure_ns = 8 * NS_PER_MS;
	plan.ir_delay_ns = 1 * NS_PER_MS;
	plan.strobe_delay_ns = 2 * NS_PER_MS;
	EXPECT_REFUSED(&plan, "exposure", "ends after the next", "shorten it or its delay");
	plan = good_plan();
	plan.ir_exposure_ns = 0;
	plan.strobe_width_ns = 0;
	EXPECT_REFUSED(&plan, "exposure", "0 us sees nothing", "give 250");
}

static void a_strobe_outside_the_exposure_is_refused(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	plan.strobe_delay_ns = 0;
	EXPECT_REFUSED(&plan, "strobe burns 0 to 200 us", "open 50 to 350 us", "move or shorten");
	plan.strobe_delay_ns = 200 * NS_PER_US;
	EXPECT_REFUSED(&plan, "strobe burns 200 to 400 us");
}

static void a_strobe_beyond_its_duty_cycle_is_refused(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	plan.ir_exposure_ns = 2 * NS_PER_MS;
	plan.strobe_width_ns = 900 * NS_PER_US;
	EXPECT_REFUSED(&plan, "strobe_width", "overheats", "0.1 of the time", "at most 833.333 us");
	plan.strobe_duty_max = 0.2;
	assert_int_equal(trigger_plan_check(&plan, "usb", NULL), 0);
	plan.strobe_duty_max = 1.5;
	EXPECT_REFUSED(&plan, "strobe_duty_max", "1.5 is not a share");
}

static void hd_frames_need_a_divider_and_a_phase_within_it(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	plan.hd_divider = 0;
	EXPECT_REFUSED(&plan, "hd.divider", "every 0-th shot", "give 1 to 1000");
	plan.hd_divider = 4;
	plan.hd_phase = 4;
	EXPECT_REFUSED(&plan, "hd.phase", "give 0 to 3");
	plan.hd_phase = -1;
	EXPECT_REFUSED(&plan, "hd.phase", "-1 is not");
	plan = good_plan();
	plan.hd_exposure_ns = 34 * NS_PER_MS;
	EXPECT_REFUSED(&plan, "hd.exposure", "between two HD frames", "33333.3 us");
	plan.hd_exposure_ns = 33 * NS_PER_MS;
	EXPECT_REFUSED(&plan, "hd.exposure", "ends after the next of the HD frames");
}

static void negative_and_absurd_times_are_refused(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	plan.strobe_delay_ns = -1 * NS_PER_US;
	EXPECT_REFUSED(&plan, "strobe_delay", "-1 us is before the edge");
	plan = good_plan();
	plan.hd_exposure_ns = -5 * NS_PER_US;
	EXPECT_REFUSED(&plan, "hd.exposure", "-5 us is a negative time");
	plan = good_plan();
	plan.period_ns = 0;
	EXPECT_REFUSED(&plan, "period", "0 us apart");
	plan = good_plan();
	plan.hd_delay_ns = INT64_MAX;
	EXPECT_REFUSED(&plan, "hd.exposure", "shorten it or its delay");
}

static void every_problem_is_told_in_one_go(void **state)
{
	struct trigger_plan plan = good_plan();
	struct diag diag = {0};

	(void)state;
	plan.ir_exposure_ns = 9 * NS_PER_MS;
	plan.hd_divider = 0;
	assert_int_equal(trigger_plan_check(&plan, "usb", &diag), -EINVAL);
	assert_int_equal(diag.count, 2);
	diag_finish(&diag);
}

static void light_is_collected_where_strobe_and_exposure_overlap(void **state)
{
	struct trigger_plan plan = good_plan();

	(void)state;
	assert_int_equal(trigger_plan_ir_middle_ns(&plan), 200 * NS_PER_US);
	plan.strobe_width_ns = 0;
	assert_int_equal(trigger_plan_ir_middle_ns(&plan), 200 * NS_PER_US);
	plan.ir_exposure_ns = 500 * NS_PER_US;
	assert_int_equal(trigger_plan_ir_middle_ns(&plan), 300 * NS_PER_US);
	assert_int_equal(trigger_plan_hd_middle_ns(&plan), 3 * NS_PER_MS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_plan_that_can_be_passes_in_silence),
		cmocka_unit_test(an_exposure_longer_than_the_period_is_refused),
		cmocka_unit_test(a_strobe_outside_the_exposure_is_refused),
		cmocka_unit_test(a_strobe_beyond_its_duty_cycle_is_refused),
		cmocka_unit_test(hd_frames_need_a_divider_and_a_phase_within_it),
		cmocka_unit_test(negative_and_absurd_times_are_refused),
		cmocka_unit_test(every_problem_is_told_in_one_go),
		cmocka_unit_test(light_is_collected_where_strobe_and_exposure_overlap),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
