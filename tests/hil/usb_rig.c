/*
 * An adapter is a process: to end it is to unplug it.
 */
#include "tests/hil/usb_rig.h"

#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/usb/trigger_usb.h"

#define PPM "80"
#define ADAPTERS 2

const struct trigger_driver *const usb_rig_driver = &usb_trigger_driver;
static const char *build;
static pid_t adapters[ADAPTERS];

const struct trigger_plan usb_rig_plan = {
	.period_ns = 200 * NS_PER_MS,
	.ir_exposure_ns = 60 * NS_PER_MS,
	.strobe_delay_ns = 4 * NS_PER_MS,
	.strobe_width_ns = 50 * NS_PER_MS,
	.strobe_duty_max = 0.5,
	.hd_divider = 4,
	.hd_phase = 1,
	.hd_delay_ns = 110 * NS_PER_MS,
	.hd_exposure_ns = 20 * NS_PER_MS,
};

void usb_rig_plug_in(int index, const char *serial, const char *product)
{
	char path[256], bus[12];

	snprintf(path, sizeof(path), "%s/tests/hil/bit_bang", build);
	snprintf(bus, sizeof(bus), "%d", index);
	adapters[index] = fork();
	if (adapters[index] == 0) {
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		execl(path, path, "--bus", bus, "--serial", serial, "--product", product, "--ppm",
		      PPM, "--trace", index ? "/dev/null" : USB_RIG_TRACE, NULL);
		_exit(127);
	}
	assert_true(adapters[index] > 0);
}

void usb_rig_unplug(int index)
{
	if (adapters[index] <= 0)
		return;
	kill(adapters[index], SIGKILL);
	waitpid(adapters[index], NULL, 0);
	adapters[index] = 0;
}

int usb_rig_find_programs(int argc, char **argv)
{
	if (argc == 2)
		build = argv[1];
	else
		fprintf(stderr, "usage: %s BUILD\n", argv[0]);
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return argc == 2 ? 0 : -EINVAL;
}

int usb_rig_begin(void **state)
{
	(void)state;
	unlink(USB_RIG_TRACE);
	usb_rig_plug_in(0, "EMU0", "6014");
	return 0;
}

int usb_rig_end(void **state)
{
	(void)state;
	for (int a = 0; a < ADAPTERS; a++)
		usb_rig_unplug(a);
	return 0;
}

void usb_rig_wait_ms(int64_t time_ms)
{
	clock_sleep_until(clock_now_ns() + time_ms * NS_PER_MS);
}

struct trigger *usb_rig_await(const char *rest)
{
	int64_t until_ns = clock_now_ns() + USB_RIG_PATIENCE_NS;
	struct trigger *trigger = NULL;
	struct diag diag = {0};

	while (usb_rig_driver->open(&trigger, rest, &diag) && clock_now_ns() < until_ns) {
		diag_finish(&diag);
		usb_rig_wait_ms(100);
	}
	if (!trigger)
		fail_msg("%s: %s", rest, diag.text);
	diag_finish(&diag);
	return trigger;
}

void usb_rig_arm(struct trigger *trigger)
{
	struct diag diag = {0};

	if (usb_rig_driver->arm(trigger, &usb_rig_plan, &diag))
		fail_msg("%s", diag.text);
}

struct edge usb_rig_next_edge(struct trigger *trigger)
{
	int64_t until_ns = clock_now_ns() + USB_RIG_PATIENCE_NS;
	struct edge edge;
	int err;

	do
		err = usb_rig_driver->next(trigger, 100 * NS_PER_MS, &edge);
	while (err == -ETIMEDOUT && clock_now_ns() < until_ns);
	assert_int_equal(err, 0);
	return edge;
}
