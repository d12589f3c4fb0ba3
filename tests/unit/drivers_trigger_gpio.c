/*
 * The GPIO trigger in virtual time: every change of every line is where the plan has it, watched by
 * the guard, and dark when it ends.
 */
#include "drivers/gpio/trigger_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tests/gpio/fake_guard.h"
#include "usual_plan.h"
#include "virtual_gpio.h"

static struct burn ir[BURNS_MAX], strobe[BURNS_MAX], hd[BURNS_MAX];

/* A process that is killed at any moment: lines are dark within a period. */
static void check_watched(int64_t period_ns)
{
	uint32_t told = 0;

	for (uint32_t i = 0; i < chip->change_count; i++) {
		int64_t at_ns = chip->changes[i].time_ns;

		while (told + 1 < fake_guard.told_count && fake_guard.told[told + 1].at_ns <= at_ns)
			told++;
		if (chip->changes[i].levels)
			assert_in_range(fake_guard.told[told].until_ns, at_ns,
					at_ns + period_ns + period_ns / PULSE_LATE_SHARE);
	}
}

static void every_line_follows_the_plan_to_the_nanosecond(void **state)
{
	const int shots = 401;
	int64_t armed_ns;

	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	armed_ns = clock_now_ns();
	for (int k = 0; k < shots; k++) {
		struct edge edge = take_edge();

		assert_int_equal(edge.shot, k);
		assert_int_equal(edge.edge_ns, armed_ns + (k + 1) * USUAL_PERIOD_NS);
		assert_int_equal(edge.missed, 0);
		assert_int_equal(edge.events, 0);
		assert_int_equal(edge.late_ns, 0);
	}
	int ir_count = burns_of(IR, 0, ir), hd_count = burns_of(HD, 0, hd);
	assert_in_range(ir_count, shots - 1, shots);
	assert_int_equal(burns_of(STROBE, 0, strobe), shots);
	assert_int_equal(hd_count, (shots + 2) / 4);
	for (int k = 0; k < ir_count; k++) {
		int64_t edge_ns = armed_ns + (k + 1) * USUAL_PERIOD_NS;

		assert_int_equal(ir[k].on_ns, edge_ns + usual_plan.ir_delay_ns);
		assert_int_equal(ir[k].off_ns, ir[k].on_ns + usual_plan.ir_exposure_ns);
		assert_int_equal(strobe[k].on_ns, edge_ns + usual_plan.strobe_delay_ns);
		assert_int_equal(strobe[k].off_ns, strobe[k].on_ns + usual_plan.strobe_width_ns);
	}
	for (int k = 0; k < hd_count; k++) {
		int64_t edge_ns = armed_ns + (4 * k + usual_plan.hd_phase + 1) * USUAL_PERIOD_NS;

		assert_int_equal(hd[k].on_ns, edge_ns + usual_plan.hd_delay_ns);
		assert_int_equal(hd[k].off_ns, hd[k].on_ns + usual_plan.hd_exposure_ns);
	}
	check_watched(USUAL_PERIOD_NS);
}

static void lines_that_are_active_low_rest_high(void **state)
{
	(void)state;
	assert_int_equal(open_lines("gpiochip0,ir=!IR_TRIG,strobe=!STROBE,hd=HD_TRIG"), 0);
	assert_int_equal(chip->levels, IR | STROBE);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &usual_plan, &diag), 0);
	atomic_store(&chip->change_count, 0);
	take_edges(9);
	assert_int_equal(burns_of(STROBE, IR | STROBE, strobe), 9);
	assert_int_equal(strobe[8].off_ns - strobe[8].on_ns, usual_plan.strobe_width_ns);
	gpio_trigger_driver.disarm(trigger);
	assert_int_equal(chip->levels, IR | STROBE);
}

static void all_is_dark_after_disarm_whatever_was_lit(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	for (int64_t into_ns = 0; into_ns < 5 * NS_PER_MS; into_ns += 130 * NS_PER_US) {
		take_edges(1);
		gpio_trigger_driver.next(trigger, USUAL_PERIOD_NS / 2 + into_ns, &edge);
		gpio_trigger_driver.disarm(trigger);
		assert_int_equal(chip->levels, 0);
		assert_int_equal(next_edge(&edge), -ENODEV);
		assert_int_equal(gpio_trigger_driver.arm(trigger, &usual_plan, &diag), 0);
		assert_int_equal(take_edge().shot, 0);
	}
}

static void what_the_guard_did_is_told(void **state)
{
	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	take_edges(2);
	fake_guard.cut_count++;
	assert_int_equal(take_edge().events, 1U << PULSE_GUARD_CUT);
	assert_int_equal(take_edge().events, 0);
}

static void without_a_guard_no_strobe_burns(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	take_edges(2);
	fake_guard.dead = true;
	assert_int_equal(next_edge(&edge), -EOWNERDEAD);
	assert_int_equal(burns_of(STROBE, 0, strobe), 2);
	gpio_trigger_driver.disarm(trigger);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &usual_plan, &diag), 0);
	assert_int_equal(fake_guard.starts, 2);
	take_edges(2);
}

static void a_chip_that_goes_away_is_told(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	take_edges(2);
	atomic_store(&chip->gone, 1);
	assert_int_equal(next_edge(&edge), -ENODEV);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &usual_plan, &diag), -ENODEV);
	assert_non_null(strstr(diag.text, "gpio:gpiochip0: the chip does not answer"));
}

static void a_plan_that_would_overheat_is_refused(void **state)
{
	struct trigger_plan hot = usual_plan;

	(void)state;
	hot.strobe_duty_max = 0.01;
	assert_int_equal(open_lines(GPIO_LINES), 0);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &hot, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "overheats"));
	assert_int_equal(chip->levels, 0);
}

int main(void)
{
#define FACT(name) cmocka_unit_test_setup_teardown(name, virtual_gpio_begin, virtual_gpio_end)
	const struct CMUnitTest tests[] = {
		FACT(every_line_follows_the_plan_to_the_nanosecond),
		FACT(lines_that_are_active_low_rest_high),
		FACT(all_is_dark_after_disarm_whatever_was_lit),
		FACT(what_the_guard_did_is_told),
		FACT(without_a_guard_no_strobe_burns),
		FACT(a_chip_that_goes_away_is_told),
		FACT(a_plan_that_would_overheat_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, virtual_gpio_create, virtual_gpio_destroy);
}
