/*
 * Adapters come and go: usb_plugs BUILD. The kernel's serial driver is loaded, and takes every
 * emulated adapter; what is refused is told with the remedy, and a killed process leaves no light.
 */
#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/hil/bit_bang_trace.h"
#include "tests/hil/usb_rig.h"

static struct bit_bang_trace trace;

/* What is said within USB_RIG_PATIENCE_NS: the kernel takes a while to see what was plugged in or
 * out. */
static void await_refusal(const char *rest, int err, const char *word, const char *other)
{
	int64_t until_ns = clock_now_ns() + USB_RIG_PATIENCE_NS;
	bool told = false;

	while (!told) {
		struct trigger *trigger = NULL;
		struct diag diag = {0};
		int got = usb_rig_driver->open(&trigger, rest, &diag);

		told = got == err && diag.count == 1 && strstr(diag.text, word) &&
		       strstr(diag.text, other);
		if (told)
			print_message("# %s", diag.text);
		else if (clock_now_ns() > until_ns)
			fail_msg("%s: %d, %s", rest, got, diag.text ? diag.text : "nothing");
		diag_finish(&diag);
		usb_rig_driver->close(trigger);
		if (!told)
			usb_rig_wait_ms(100);
	}
}

static void adapters_are_told_apart_by_their_serial_numbers(void **state)
{
	struct trigger *trigger;

	(void)state;
	usb_rig_plug_in(1, "EMU1", "6014");
	await_refusal("", -EINVAL, "there are 2 adapters", "EMU1");
	trigger = usb_rig_await("EMU1,strobe=D3");
	await_refusal("EMU1", -EBUSY, "another program", "EMU1");
	await_refusal("EMU2", -ENODEV, "no such adapter", "EMU0");
	usb_rig_driver->close(trigger);
	usb_rig_driver->close(usb_rig_await("EMU0"));
}

static void wrong_chip_is_named_and_so_is_none(void **state)
{
	(void)state;
	usb_rig_unplug(0);
	await_refusal("EMU0", -ENODEV, "no FT232H adapter", "plug one in");
	usb_rig_plug_in(0, "EMU0", "6001");
	await_refusal("EMU0", -ENODEV, "FT232R (0403:6001)", "plug in an FT232H");
}

static void await_serial_port(bool wanted)
{
	int64_t until_ns = clock_now_ns() + USB_RIG_PATIENCE_NS;

	while ((access("/dev/ttyUSB0", F_OK) == 0) != wanted && clock_now_ns() < until_ns)
		usb_rig_wait_ms(50);
	assert_int_equal(access("/dev/ttyUSB0", F_OK) == 0, wanted);
}

static void serial_driver_lets_go_and_does_not_come_back(void **state)
{
	struct trigger *trigger;

	(void)state;
	await_serial_port(true);
	trigger = usb_rig_await("EMU0");
	await_serial_port(false);
	usb_rig_driver->close(trigger);
	usb_rig_wait_ms(300);
	await_serial_port(false);
	usb_rig_driver->close(usb_rig_await("EMU0"));
}

/* As a user who may not. */
static void adapter_that_may_not_be_opened_is_told_with_the_group(void **state)
{
	int status;

	(void)state;
	usb_rig_driver->close(usb_rig_await("EMU0"));
	pid_t child = fork();

	if (child == 0) {
		struct trigger *trigger = NULL;
		struct diag diag = {0};

		if (setuid(65534))
			_exit(2);
		int err = usb_rig_driver->open(&trigger, "EMU0", &diag);
		_exit(err == -EACCES && diag.count == 1 && strstr(diag.text, "stage-operator") ? 0
											       : 1);
	}
	waitpid(child, &status, 0);
	assert_int_equal(status, 0);
}

static void adapter_that_is_unplugged_is_told_and_opens_again_when_it_is_back(void **state)
{
	struct trigger *trigger = usb_rig_await("EMU0");
	int64_t until_ns;
	struct edge edge;
	int err;

	(void)state;
	usb_rig_arm(trigger);
	for (int i = 0; i < 3; i++)
		usb_rig_next_edge(trigger);
	usb_rig_unplug(0);
	until_ns = clock_now_ns() + USB_RIG_PATIENCE_NS;
	do
		err = usb_rig_driver->next(trigger, 100 * NS_PER_MS, &edge);
	while ((err == 0 || err == -ETIMEDOUT) && clock_now_ns() < until_ns);
	assert_true(err == -ENODEV || err == -EIO);
	usb_rig_driver->disarm(trigger);
	usb_rig_driver->close(trigger);
	await_refusal("EMU0", -ENODEV, "no FT232H adapter", "plug one in");
	usb_rig_plug_in(0, "EMU0", "6014");
	trigger = usb_rig_await("EMU0");
	usb_rig_arm(trigger);
	usb_rig_next_edge(trigger);
	usb_rig_driver->close(trigger);
}

static pid_t start_victim(void)
{
	pid_t child = fork();

	if (child == 0) {
		struct trigger *trigger = usb_rig_await("EMU0");
		struct edge edge;

		usb_rig_arm(trigger);
		for (;;)
			usb_rig_driver->next(trigger, 100 * NS_PER_MS, &edge);
	}
	assert_true(child > 0);
	return child;
}

/* Until its pulses are on the lines. */
static void await_pulses(int64_t started_ns)
{
	int64_t until_ns = started_ns + USB_RIG_PATIENCE_NS;

	do {
		assert_true(clock_now_ns() < until_ns);
		usb_rig_wait_ms(20);
		bit_bang_trace_read(&trace, USB_RIG_TRACE);
	} while (bit_bang_trace_last_change(&trace)->time_ns < started_ns);
}

/* At different times of a shot. What the kernel still has on its way may be put out. */
static void lines_of_a_killed_process_are_dark(void **state)
{
	(void)state;
	usb_rig_driver->close(usb_rig_await("EMU0"));
	for (int i = 0; i < 3; i++) {
		int64_t started_ns = clock_now_ns();
		pid_t victim = start_victim();

		await_pulses(started_ns);
		usb_rig_wait_ms(60 * i);
		kill(victim, SIGKILL);
		waitpid(victim, NULL, 0);
		int64_t dead_ns = clock_now_ns();
		usb_rig_wait_ms(400);
		bit_bang_trace_read(&trace, USB_RIG_TRACE);
		const struct bit_bang_record *last = bit_bang_trace_last_change(&trace);

		assert_int_equal(last->levels, 0);
		assert_true(last->time_ns < dead_ns + usb_rig_plan.period_ns);
		assert_int_equal(bit_bang_trace_count(&trace, BIT_BANG_LIT), 0);
	}
}

int main(int argc, char **argv)
{
#define PLUGGED(name) cmocka_unit_test_setup_teardown(name, usb_rig_begin, usb_rig_end)
	const struct CMUnitTest tests[] = {
		PLUGGED(serial_driver_lets_go_and_does_not_come_back),
		PLUGGED(adapters_are_told_apart_by_their_serial_numbers),
		PLUGGED(wrong_chip_is_named_and_so_is_none),
		PLUGGED(adapter_that_may_not_be_opened_is_told_with_the_group),
		PLUGGED(adapter_that_is_unplugged_is_told_and_opens_again_when_it_is_back),
		PLUGGED(lines_of_a_killed_process_are_dark),
	};

	if (usb_rig_find_programs(argc, argv))
		return EXIT_FAILURE;
	return cmocka_run_group_tests(tests, NULL, NULL);
}
