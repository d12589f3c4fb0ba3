/*
 * The GPIO trigger with threads that wake up late and calls that take long: pulses are shortened,
 * skipped and named, and the strobe never burns for longer than it may.
 */
#include "drivers/gpio/trigger_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "tests/gpio/fake_guard.h"
#include "usual_plan.h"
#include "virtual_gpio.h"

static struct burn ir[BURNS_MAX], strobe[BURNS_MAX];

/* When the guard would have set the lines dark, had they been lit from then on. */
static int64_t guard_cuts_at(int64_t lit_ns)
{
	for (uint32_t i = 0; i < fake_guard.told_count; i++) {
		int64_t until_ns = fake_guard.told[i].until_ns;
		int64_t next_ns =
			i + 1 < fake_guard.told_count ? fake_guard.told[i + 1].at_ns : INT64_MAX;

		if (next_ns > lit_ns && until_ns && until_ns < next_ns)
			return until_ns;
	}
	return INT64_MAX;
}

/* As the guard would have had it. */
static int guarded_burns(void)
{
	int count = burns_of(STROBE, 0, strobe);

	for (int k = 0; k < count; k++) {
		int64_t cut_ns = guard_cuts_at(strobe[k].on_ns);

		if (strobe[k].off_ns > cut_ns)
			strobe[k].off_ns = cut_ns;
	}
	return count;
}

/* Numbers say when: every shot is fired in its own period, a little late at most, and what was
 * missed is told. */
static void check_numbers(const struct edge *edges, int count, int64_t armed_ns,
			  const struct trigger_plan *with)
{
	int64_t late_max_ns = with->period_ns / PULSE_LATE_SHARE;
	int ir_count = burns_of(IR, 0, ir);
	uint64_t expected = 0;

	for (int k = 0; k < count; k++) {
		int64_t due_ns = armed_ns + (int64_t)(edges[k].shot + 1) * with->period_ns;

		assert_int_equal(edges[k].shot, expected + edges[k].missed);
		expected = edges[k].shot + 1;
		assert_in_range(edges[k].late_ns, 0, 40 * NS_PER_MS);
		/* earlier when the strobe was spared the end of its pulse */
		assert_in_range(edges[k].edge_ns, due_ns - with->strobe_width_ns / 4 - 1,
				due_ns + 40 * NS_PER_MS);
	}
	assert_in_range(ir_count, count - 1, count); /* each has a pulse of its own */
	for (int k = 0; k < ir_count; k++) {
		int64_t after_ns = ir[k].on_ns - armed_ns - with->ir_delay_ns;

		if (k)
			assert_true(after_ns / with->period_ns >
				    (ir[k - 1].on_ns - armed_ns - with->ir_delay_ns) /
					    with->period_ns);
		/* only the setting itself may take longer */
		if (!chip->slow_before_ns)
			assert_in_range(after_ns % with->period_ns, 0, late_max_ns + 1);
	}
}

/* Wakes up late, and sets lines slowly, for up to three periods. */
static void live_through_stalls(uint64_t seed, const struct trigger_plan *with)
{
	static struct edge edges[600];
	struct rng rng;
	int64_t armed_ns, total = 0;

	rng_init(&rng, seed, 0);
	memset(&fake_guard, 0, sizeof(fake_guard));
	arm_lines(GPIO_LINES, with);
	armed_ns = clock_now_ns();
	for (int k = 0; k < 600; k++) {
		if (rng_uniform(&rng) < 0.1)
			clock_sleep_until(clock_now_ns() + (int64_t)(rng_uniform(&rng) * 3 *
								     (double)USUAL_PERIOD_NS));
		if (rng_uniform(&rng) < 0.1) {
			chip->slow_after_ns = (int64_t)(rng_uniform(&rng) * 2e6);
			atomic_store(&chip->slow_change,
				     chip->change_count + 1 + rng_u32(&rng) % 6);
		}
		edges[k] = take_edge();
		total += edges[k].missed;
	}
	check_numbers(edges, 600, armed_ns, with);
	assert_true(total > 10);
	int count = guarded_burns();
	for (int k = 0; k < count; k++)
		assert_true(strobe[k].off_ns - strobe[k].on_ns <= burn_max_ns(with));
	check_duty(strobe, count, with);
	gpio_trigger_driver.close(trigger);
	trigger = NULL;
	atomic_store(&chip->slow_change, 0);
}

static void stalls_shorten_and_skip_and_name_but_never_burn_longer(void **state)
{
	struct trigger_plan at_the_limit = usual_plan, always_open = usual_plan;

	(void)state;
	always_open.ir_exposure_ns = USUAL_PERIOD_NS - always_open.ir_delay_ns;
	at_the_limit.strobe_width_ns = 400 * NS_PER_US;
	at_the_limit.strobe_delay_ns = at_the_limit.ir_delay_ns;
	at_the_limit.strobe_duty_max = 0.05;
	for (uint64_t seed = 1; seed <= 10; seed++) {
		live_through_stalls(seed, &usual_plan);
		live_through_stalls(seed, &at_the_limit);
		live_through_stalls(seed, &always_open);
	}
}

static void a_strobe_at_its_limit_keeps_burning(void **state)
{
	struct trigger_plan at_the_limit = usual_plan;

	(void)state;
	at_the_limit.strobe_duty_max = 250e3 / USUAL_PERIOD_NS;
	arm_lines(GPIO_LINES, &at_the_limit);
	for (int k = 0; k < 300; k++)
		assert_int_equal(take_edge().events, 0);
	assert_int_equal(burns_of(STROBE, 0, strobe), 300);
}

static void a_strobe_that_is_lit_late_goes_out_in_time(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines("gpiochip0,ir=IR_TRIG,strobe=STROBE", &usual_plan);
	take_edges(3);
	chip->slow_after_ns = 150 * NS_PER_US; /* of the IR line: 100 us into the strobe's time */
	atomic_store(&chip->slow_change, chip->change_count + 2);
	edge = take_edge();
	assert_int_equal(edge.events, 1U << PULSE_STROBE_SHORT);
	int count = burns_of(STROBE, 0, strobe);
	int64_t burnt_ns = strobe[count - 1].off_ns - strobe[count - 1].on_ns;
	assert_in_range(burnt_ns, 140 * NS_PER_US, 230 * NS_PER_US);
	/* its middle is told as it was */
	int64_t middle_ns = strobe[count - 1].on_ns + burnt_ns / 2;
	int64_t told_ns =
		edge.edge_ns + usual_plan.strobe_delay_ns + usual_plan.strobe_width_ns / 2;
	assert_true(llabs(middle_ns - told_ns) <= edge.uncertainty_ns);
}

static void a_strobe_that_would_be_too_short_stays_dark(void **state)
{
	(void)state;
	arm_lines("gpiochip0,ir=IR_TRIG,strobe=STROBE", &usual_plan);
	take_edges(3);
	chip->slow_after_ns = 400 * NS_PER_US;
	atomic_store(&chip->slow_change, chip->change_count + 2);
	assert_int_equal(take_edge().events, 1U << PULSE_STROBE_SKIPPED);
	assert_int_equal(burns_of(STROBE, 0, strobe), 3);
	assert_int_equal(take_edge().events, 0);
}

static void periods_that_were_slept_through_are_named(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines(GPIO_LINES, &usual_plan);
	take_edges(10);
	clock_sleep_until(clock_now_ns() + 5 * USUAL_PERIOD_NS);
	edge = take_edge();
	assert_int_equal(edge.missed, 5);
	assert_int_equal(edge.shot, 15);
	assert_int_equal(take_edge().missed, 0);
}

int main(void)
{
#define FACT(name) cmocka_unit_test_setup_teardown(name, virtual_gpio_begin, virtual_gpio_end)
	const struct CMUnitTest tests[] = {
		FACT(stalls_shorten_and_skip_and_name_but_never_burn_longer),
		FACT(a_strobe_at_its_limit_keeps_burning),
		FACT(a_strobe_that_is_lit_late_goes_out_in_time),
		FACT(a_strobe_that_would_be_too_short_stays_dark),
		FACT(periods_that_were_slept_through_are_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, virtual_gpio_create, virtual_gpio_destroy);
}
