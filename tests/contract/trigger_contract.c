/*
 * The tests that every trigger driver with edges must pass.
 */
#include "tests/contract/trigger_contract.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"

#define EDGES 40
#define SLACK_NS (500 * NS_PER_MS) /* of a busy machine */

static const struct trigger_contract *contract;
static struct trigger *trigger;

static int open_trigger(void **state)
{
	struct diag diag = {0};

	(void)state;
	trigger = NULL;
	int err = contract->driver->open(&trigger, contract->rest, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err;
}

static int close_trigger(void **state)
{
	(void)state;
	contract->driver->close(trigger);
	trigger = NULL;
	return 0;
}

static void assert_dark(void)
{
	for (const char *const *path = contract->dark; *path; path++) {
		FILE *file = fopen(*path, "r");
		int level = file ? fgetc(file) : EOF;

		if (file)
			fclose(file);
		if (level != '0')
			fail_msg("%s reads %c", *path, level);
	}
}

static void arm(void)
{
	struct diag diag = {0};
	int err = contract->driver->arm(trigger, contract->plan, &diag);

	diag_print(&diag, stderr);
	assert_int_equal(err, 0);
	assert_int_equal(diag.count, 0);
}

static struct edge take_edge(void)
{
	int64_t until_ns = clock_now_ns() + 2 * contract->plan->period_ns + 10 * SLACK_NS;
	struct edge edge;
	int err;

	do
		err = contract->driver->next(trigger, 100 * NS_PER_MS, &edge);
	while (err == -ETIMEDOUT && clock_now_ns() < until_ns);
	assert_int_equal(err, 0);
	return edge;
}

static void an_address_that_does_not_work_is_refused_with_a_reason(void **state)
{
	struct trigger *none = (struct trigger *)1;
	struct diag diag = {0};

	(void)state;
	assert_true(contract->driver->open(&none, contract->bad_rest, &diag) < 0);
	assert_ptr_equal(none, (struct trigger *)1);
	assert_int_equal(diag.count, 1);
	diag_finish(&diag);
}

struct looked_for {
	char name[64]; /* of the device, in the address */
	int found;
};

static void note(const struct trigger_info *info, void *user)
{
	struct looked_for *device = user;
	size_t length = strlen(contract->driver->name);

	assert_memory_equal(info->address, contract->driver->name, length);
	assert_int_equal(info->address[length], ':');
	device->found += strstr(info->address, device->name) || strstr(info->device, device->name);
}

static void a_device_that_is_there_is_listed(void **state)
{
	struct looked_for device = {0};
	struct diag diag = {0};

	(void)state;
	if (!contract->driver->list)
		return; /* it has no devices */
	snprintf(device.name, sizeof(device.name), "%.*s", (int)strcspn(contract->rest, ","),
		 contract->rest);
	assert_int_equal(contract->driver->list(note, &device, &diag), 0);
	assert_int_equal(device.found, 1);
	assert_int_equal(diag.count, 0);
}

static void closing_nothing_is_harmless(void **state)
{
	(void)state;
	contract->driver->close(NULL);
}

static void all_is_dark_before_it_is_armed(void **state)
{
	struct edge edge;

	(void)state;
	assert_dark();
	assert_true(contract->driver->next(trigger, NS_PER_MS, &edge) < 0);
	contract->driver->disarm(trigger);
	assert_dark();
}

static void a_plan_that_would_overheat_is_refused_with_a_reason(void **state)
{
	struct trigger_plan hot = *contract->plan;
	struct diag diag = {0};

	(void)state;
	hot.strobe_duty_max = (double)hot.strobe_width_ns / (double)hot.period_ns / 2;
	assert_int_equal(contract->driver->arm(trigger, &hot, &diag), -EINVAL);
	assert_true(diag.count > 0);
	diag_finish(&diag);
	assert_dark();
}

/* Numbers tell the time, also of what was missed. */
static void edges_come_in_order_and_their_numbers_tell_the_time(void **state)
{
	struct edge before = {0}, edge;
	int64_t period_ns = contract->plan->period_ns;

	(void)state;
	arm();
	for (int i = 0; i < EDGES; i++) {
		if (i == EDGES / 2) /* nobody asks for a while */
			clock_sleep_until(clock_now_ns() + 5 * period_ns);
		edge = take_edge();
		assert_true(edge.edge_ns <= clock_now_ns() + NS_PER_MS);
		assert_true(edge.uncertainty_ns > 0);
		assert_true(edge.late_ns >= 0);
		if (i) {
			int64_t passed_ns = edge.edge_ns - before.edge_ns;
			int64_t periods = (int64_t)(edge.shot - before.shot);

			assert_int_equal(edge.shot, before.shot + 1 + edge.missed);
			assert_true(llabs(passed_ns - periods * period_ns) <=
				    period_ns / 2 + edge.uncertainty_ns + before.uncertainty_ns);
		}
		before = edge;
	}
}

static void timeouts_are_kept(void **state)
{
	struct edge edge;

	(void)state;
	arm();
	for (int i = 0; i < 20; i++) {
		int64_t begin_ns = clock_now_ns();
		int err = contract->driver->next(trigger, contract->plan->period_ns / 10, &edge);

		assert_true(err == 0 || err == -ETIMEDOUT);
		assert_true(clock_now_ns() - begin_ns < SLACK_NS);
	}
}

static void all_is_dark_after_disarm(void **state)
{
	struct edge edge;

	(void)state;
	for (int i = 0; i < 5; i++) {
		arm();
		take_edge();
		contract->driver->next(trigger, (i + 1) * contract->plan->period_ns / 5, &edge);
		contract->driver->disarm(trigger);
		assert_dark();
		contract->driver->disarm(trigger);
		assert_dark();
	}
	arm();
	take_edge();
	take_edge();
}

static void all_is_dark_when_it_is_closed_and_opened_again(void **state)
{
	(void)state;
	arm();
	take_edge();
	contract->driver->disarm(trigger);
	contract->driver->close(trigger);
	trigger = NULL;
	assert_dark();
	assert_int_equal(open_trigger(state), 0);
	assert_dark();
	arm();
	take_edge();
}

int trigger_contract_run(const struct trigger_contract *driver_contract)
{
#define OPEN(name) cmocka_unit_test_setup_teardown(name, open_trigger, close_trigger)
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_address_that_does_not_work_is_refused_with_a_reason),
		cmocka_unit_test(a_device_that_is_there_is_listed),
		cmocka_unit_test(closing_nothing_is_harmless),
		OPEN(all_is_dark_before_it_is_armed),
		OPEN(a_plan_that_would_overheat_is_refused_with_a_reason),
		OPEN(edges_come_in_order_and_their_numbers_tell_the_time),
		OPEN(timeouts_are_kept),
		OPEN(all_is_dark_after_disarm),
		OPEN(all_is_dark_when_it_is_closed_and_opened_again),
	};

	contract = driver_contract;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}

const struct trigger_plan trigger_contract_fast_plan = {.period_ns = 10 * NS_PER_MS,
							.ir_exposure_ns = 250 * NS_PER_US,
							.strobe_width_ns = 250 * NS_PER_US,
							.strobe_duty_max = 0.1,
							.hd_divider = 4,
							.hd_phase = 1,
							.hd_exposure_ns = 12 * NS_PER_MS};

int trigger_contract_main(int argc, char **argv, const struct trigger_driver *driver,
			  const char *bad_rest, const char *device)
{
	/* slow enough for a virtual machine */
	static const struct trigger_plan plan = {.period_ns = 100 * NS_PER_MS,
						 .ir_exposure_ns = 45 * NS_PER_MS,
						 .strobe_delay_ns = 4 * NS_PER_MS,
						 .strobe_width_ns = 8 * NS_PER_MS,
						 .strobe_duty_max = 0.5,
						 .hd_divider = 4,
						 .hd_phase = 1,
						 .hd_exposure_ns = 40 * NS_PER_MS};

	if (argc < 2) {
		printf("1..0 # SKIP no %s named; ./stage hil has one\n", device);
		return 0;
	}
	const struct trigger_contract contract_of_device = {
		.driver = driver,
		.rest = argv[1],
		.bad_rest = bad_rest,
		.dark = (const char *const *)argv + 2,
		.plan = &plan,
	};

	return trigger_contract_run(&contract_of_device);
}
