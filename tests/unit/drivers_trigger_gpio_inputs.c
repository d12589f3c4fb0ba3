/*
 * The inputs of the GPIO trigger in virtual time: an exposure output tells when a camera exposed, a
 * genlock paces the shots, and what is wrong with either is named.
 */
#include "drivers/gpio/trigger_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "usual_plan.h"
#include "virtual_gpio.h"

static struct burn strobe[BURNS_MAX];

static void add_input_edge(int64_t time_ns)
{
	chip->edges_ns[chip->edge_count % FAKE_GPIO_EDGES] = time_ns;
	atomic_fetch_add(&chip->edge_count, 1);
}

static void the_input_tells_when_a_camera_exposed(void **state)
{
	const int64_t delay_ns = 33 * NS_PER_US;
	struct trigger_plan dark = usual_plan;
	struct edge edge;

	(void)state;
	dark.strobe_width_ns = 0;
	arm_lines(GPIO_LINES ",exposure=EXPOSURE", &dark);
	int64_t armed_ns = clock_now_ns();
	for (int k = 0; k < 100; k++) {
		int64_t pulse_ns = armed_ns + (k + 1) * USUAL_PERIOD_NS + dark.ir_delay_ns;
		int64_t off_ns = k == 50 ? 900 * NS_PER_US : 0;
		uint32_t expected = 0;

		if (k == 60)
			expected = 1U << PULSE_INPUT_MISSING;
		else
			add_input_edge(pulse_ns + delay_ns + off_ns);
		if (k == 50)
			expected = 1U << PULSE_INPUT_JITTER;
		if (k == 70) {
			add_input_edge(pulse_ns + delay_ns + 40 * NS_PER_US);
			expected = 1U << PULSE_INPUT_DOUBLED;
		}
		edge = take_edge();
		assert_int_equal(edge.shot, k);
		assert_int_equal(edge.events, expected);
		assert_int_equal(edge.edge_ns - (pulse_ns - dark.ir_delay_ns),
				 k == 60 ? 0 : delay_ns + off_ns);
	}
}

static void an_exposure_that_is_told_too_late_is_nobodys(void **state)
{
	(void)state;
	arm_lines(GPIO_LINES ",exposure=EXPOSURE", &usual_plan);
	int64_t armed_ns = clock_now_ns();

	add_input_edge(armed_ns + USUAL_PERIOD_NS + 5 * NS_PER_MS); /* 5 ms behind the pulse */
	assert_int_equal(take_edge().events, 1U << PULSE_INPUT_MISSING);
	add_input_edge(armed_ns + 2 * USUAL_PERIOD_NS + usual_plan.ir_delay_ns + 10000);
	assert_int_equal(take_edge().events, 1U << PULSE_INPUT_DOUBLED);
}

static void a_genlock_paces_the_shots_and_its_faults_are_named(void **state)
{
	struct edge edge;

	(void)state;
	arm_lines(GPIO_LINES ",genlock=SYNC_IN", &usual_plan);
	int64_t at_ns = clock_now_ns() + NS_PER_S;
	uint64_t shot = 0;

	for (int k = 0; k < 100; k++, shot++) {
		uint32_t expected = 0, missed = 0;

		at_ns += USUAL_PERIOD_NS + (k % 3 - 1) * 10 * NS_PER_US; /* a pace of its own */
		if (k == 40) { /* three pulses were lost on the way */
			at_ns += 3 * USUAL_PERIOD_NS;
			missed = 3;
		}
		if (k == 60) {
			at_ns += USUAL_PERIOD_NS / 8;
			expected = 1U << PULSE_INPUT_JITTER;
		}
		add_input_edge(at_ns);
		if (k == 70)
			add_input_edge(at_ns + NS_PER_MS); /* bounced */
		if (k == 71)
			expected = 1U << PULSE_INPUT_DOUBLED;
		edge = take_edge();
		shot += missed;
		assert_int_equal(edge.missed, missed);
		assert_int_equal(edge.shot, shot);
		assert_int_equal(edge.events, expected);
		assert_true(llabs(edge.edge_ns - at_ns) <= edge.uncertainty_ns + 110 * NS_PER_US);
	}
	assert_int_equal(burns_of(STROBE, 0, strobe), 100);
	assert_int_equal(gpio_trigger_driver.next(trigger, 50 * NS_PER_MS, &edge), -ETIMEDOUT);
}

static void a_genlock_that_runs_too_fast_does_not_overheat_the_strobe(void **state)
{
	struct trigger_plan at_the_limit = usual_plan;

	(void)state;
	at_the_limit.strobe_duty_max = 250e3 / USUAL_PERIOD_NS;
	arm_lines(GPIO_LINES ",genlock=SYNC_IN", &at_the_limit);
	int64_t at_ns = clock_now_ns();
	for (int k = 0; k < 200; k++) {
		at_ns += USUAL_PERIOD_NS * 5 / 8;
		add_input_edge(at_ns);
		take_edge();
	}
	int count = burns_of(STROBE, 0, strobe);
	assert_in_range(count, 50, 200);
	check_duty(strobe, count, &at_the_limit);
}

int main(void)
{
#define FACT(name) cmocka_unit_test_setup_teardown(name, virtual_gpio_begin, virtual_gpio_end)
	const struct CMUnitTest tests[] = {
		FACT(the_input_tells_when_a_camera_exposed),
		FACT(an_exposure_that_is_told_too_late_is_nobodys),
		FACT(a_genlock_paces_the_shots_and_its_faults_are_named),
		FACT(a_genlock_that_runs_too_fast_does_not_overheat_the_strobe),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, virtual_gpio_create, virtual_gpio_destroy);
}
