/*
 * The gpio trigger on lines of the kernel: gpio_trigger CHIP DEVICE CONFIG, a chip of gpio-sim with
 * the lines IR_TRIG, STROBE, HD_TRIG and SYNC_IN, its directory and the one that takes it away.
 * Truth is the kernel's trace of the lines.
 */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/gpio/trigger_gpio.h"
#include "drivers/trigger_plan.h"
#include "tests/hil/gpio_sim.h"
#include "tests/hil/line_watch.h"

enum line { IR, STROBE, HD, LINE_COUNT, SYNC = LINE_COUNT };

#define SHOTS 40
#define PULSES_MAX 400
#define TRACE_NS (2 * NS_PER_US)    /* its resolution */
#define ONE_CALL_NS (5 * NS_PER_MS) /* lines that are set together, one after the other */
#define PATIENCE_NS (10 * NS_PER_S)

static const struct trigger_driver *const driver = &gpio_trigger_driver;
static const char *chip, *device, *config;
static char address[160], genlocked[160];

static const struct trigger_plan plan = {
	.period_ns = 100 * NS_PER_MS,
	.ir_exposure_ns = 20 * NS_PER_MS,
	.strobe_delay_ns = 4 * NS_PER_MS,
	.strobe_width_ns = 8 * NS_PER_MS,
	.strobe_duty_max = 0.5, /* the guard leaves it alone for so long: the machine is slow */
	.hd_divider = 4,
	.hd_phase = 1,
	.hd_exposure_ns = 40 * NS_PER_MS,
};

struct pulses {
	int count;
	struct {
		int64_t on_ns, off_ns;
	} at[PULSES_MAX];
};

static struct trigger *open_trigger(const char *rest)
{
	struct trigger *trigger = NULL;
	struct diag diag = {0};
	int err = driver->open(&trigger, rest, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
	return trigger;
}

static void arm(struct trigger *trigger)
{
	struct diag diag = {0};
	int err = driver->arm(trigger, &plan, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
}

/* One message, which has all of the words. */
static void assert_refused(const char *rest, int err, const char *word, const char *other)
{
	struct trigger *trigger = NULL;
	struct diag diag = {0};

	assert_int_equal(driver->open(&trigger, rest, &diag), err);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, word));
	assert_non_null(strstr(diag.text, other));
	diag_finish(&diag);
}

static struct edge next_edge(struct trigger *trigger)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	struct edge edge;
	int err;

	do
		err = driver->next(trigger, 100 * NS_PER_MS, &edge);
	while (err == -ETIMEDOUT && clock_now_ns() < until_ns);
	assert_int_equal(err, 0);
	return edge;
}

static void read_pulses(struct line_watch *watch, struct pulses *out)
{
	struct line_change change;

	out->count = 0;
	for (bool lit = false; line_watch_next(watch, 200, &change) == 0; lit = change.level) {
		if (change.level && !lit)
			out->at[out->count].on_ns = change.time_ns;
		if (!change.level && lit)
			out->at[out->count++].off_ns = change.time_ns;
		assert_true(out->count < PULSES_MAX);
	}
}

static void watch_lines(struct line_watch watches[LINE_COUNT])
{
	for (unsigned int l = 0; l < LINE_COUNT; l++)
		assert_int_equal(line_watch_open(&watches[l], device, l), 0);
}

static void read_lines(struct line_watch watches[LINE_COUNT], struct pulses lines[LINE_COUNT])
{
	for (int l = 0; l < LINE_COUNT; l++) {
		read_pulses(&watches[l], &lines[l]);
		line_watch_close(&watches[l]);
	}
}

/* The pulse of `line` that begins within [from_ns, to_ns], or -1. */
static int find_pulse(const struct pulses *line, int64_t from_ns, int64_t to_ns)
{
	for (int i = 0; i < line->count; i++)
		if (line->at[i].on_ns >= from_ns && line->at[i].on_ns <= to_ns)
			return i;
	return -1;
}

static bool has_event(const struct edge *edge, enum pulse_event event)
{
	return edge->events >> event & 1;
}

static int count_pulses(const struct pulses *line, int64_t from_ns, int64_t to_ns)
{
	int count = 0;

	for (int i = 0; i < line->count; i++)
		count += line->at[i].on_ns >= from_ns && line->at[i].on_ns < to_ns;
	return count;
}

/* The middle of its light, while a shutter is open that the pulse opened, is where the edge says,
 * within its bound, unless the guard put an end to it. Returns how many IR pulses it had. */
static int check_shot(const struct edge *edge, const struct pulses lines[LINE_COUNT])
{
	int64_t from_ns = edge->edge_ns - plan.period_ns / 2, to_ns = from_ns + plan.period_ns;
	int ir_count = count_pulses(&lines[IR], from_ns, to_ns);
	int strobe = find_pulse(&lines[STROBE], from_ns, to_ns);
	int hd_count = count_pulses(&lines[HD], from_ns, to_ns);
	bool cut = has_event(edge, PULSE_GUARD_CUT);

	assert_in_range(ir_count, 1, cut ? 2 : 1);
	assert_true(strobe >= 0 || has_event(edge, PULSE_STROBE_SKIPPED));
	assert_in_range(hd_count, edge->shot % 4 == 1 && !has_event(edge, PULSE_HD_SKIPPED),
			edge->shot % 4 == 1 ? 1 + cut : 0);
	if (strobe < 0 || cut)
		return ir_count;
	int ir = find_pulse(&lines[IR], from_ns, to_ns);
	int64_t lit_ns = lines[STROBE].at[strobe].on_ns, dark_ns = lines[STROBE].at[strobe].off_ns;
	int64_t told_ns = edge->edge_ns + trigger_plan_ir_middle_ns(&plan);

	assert_true(dark_ns - lit_ns <= plan.period_ns / 2 + TRACE_NS);
	int64_t shut_ns = lines[IR].at[ir].on_ns + plan.ir_exposure_ns;
	int64_t middle_ns = (lit_ns + (dark_ns < shut_ns ? dark_ns : shut_ns)) / 2;

	if (llabs(told_ns - middle_ns) > edge->uncertainty_ns + TRACE_NS)
		fail_msg("shot %d: told %ld ns after the middle of its light, within %ld; lit "
			 "%ld ns after the exposure began, for %ld; events %x",
			 (int)edge->shot, (long)(told_ns - middle_ns), (long)edge->uncertainty_ns,
			 (long)(lit_ns - lines[IR].at[ir].on_ns), (long)(dark_ns - lit_ns),
			 edge->events);
	return ir_count;
}

static void what_is_reported_is_what_was_on_the_wires(void **state)
{
	static struct pulses lines[LINE_COUNT];
	struct trigger *trigger = open_trigger(address);
	struct line_watch watches[LINE_COUNT];
	struct edge edges[SHOTS];
	uint32_t missed = 0;
	int pulses = 0;

	(void)state;
	watch_lines(watches);
	arm(trigger);
	for (int i = 0; i < SHOTS; i++) {
		edges[i] = next_edge(trigger);
		assert_int_equal(edges[i].shot,
				 (i > 0 ? edges[i - 1].shot + 1 : 0) + edges[i].missed);
		missed += edges[i].missed;
	}
	driver->disarm(trigger);
	for (unsigned int l = 0; l < LINE_COUNT; l++)
		assert_int_equal(gpio_sim_level(device, l), 0);
	driver->close(trigger);
	read_lines(watches, lines);
	for (int i = 0; i < SHOTS; i++)
		pulses += check_shot(&edges[i], lines);
	assert_in_range(lines[IR].count, pulses, pulses + 1); /* one more was under way */
	print_message("# %u periods missed by a busy machine\n", missed);
}

static void strobe_is_dark_when_the_trigger_is_closed_in_mid_pulse(void **state)
{
	struct trigger *trigger = open_trigger(address);
	struct trigger_plan long_burn = plan;
	struct diag diag = {0};
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;

	(void)state;
	long_burn.strobe_duty_max = 0.9;
	long_burn.ir_exposure_ns = 90 * NS_PER_MS;
	long_burn.strobe_width_ns = 80 * NS_PER_MS;
	assert_int_equal(driver->arm(trigger, &long_burn, &diag), 0);
	diag_finish(&diag);
	while (gpio_sim_level(device, STROBE) == 0 && clock_now_ns() < until_ns) {
		struct edge edge;

		driver->next(trigger, 5 * NS_PER_MS, &edge);
	}
	assert_int_equal(gpio_sim_level(device, STROBE), 1);
	driver->close(trigger);
	assert_int_equal(gpio_sim_level(device, STROBE), 0);
}

static void chip_or_line_that_is_not_there_is_named_with_those_that_are(void **state)
{
	char rest[160];

	(void)state;
	assert_refused("no-such-chip,ir=IR_TRIG", -ENODEV, "no-such-chip", chip);
	snprintf(rest, sizeof(rest), "%s,ir=NO_LINE", chip);
	assert_refused(rest, -ENOENT, "NO_LINE", "IR_TRIG");
}

static void line_that_another_program_has_is_busy(void **state)
{
	struct trigger *trigger = open_trigger(address);

	(void)state;
	assert_refused(address, -EBUSY, "IR_TRIG", "stage trigger");
	driver->close(trigger);
	driver->close(open_trigger(address));
}

static void edges_of_an_input_pace_the_shots(void **state)
{
	struct trigger *trigger = open_trigger(genlocked);
	static struct pulses ir;
	struct line_watch watch;
	int fired = 0;

	(void)state;
	assert_int_equal(line_watch_open(&watch, device, IR), 0);
	arm(trigger);
	for (int i = 0; i < 10; i++) {
		int64_t before_ns = clock_now_ns(), after_ns;
		struct edge edge;

		assert_int_equal(gpio_sim_drive(device, SYNC, true), 0);
		after_ns = clock_now_ns();
		if (driver->next(trigger, plan.period_ns, &edge) == 0) {
			fired++;
			/* its own time stands still only while the machine does */
			assert_true(edge.edge_ns + edge.uncertainty_ns >= before_ns);
			assert_true(edge.edge_ns <= after_ns + plan.period_ns);
		}
		assert_int_equal(gpio_sim_drive(device, SYNC, false), 0);
		clock_sleep_until(before_ns + plan.period_ns);
	}
	driver->close(trigger);
	read_pulses(&watch, &ir);
	line_watch_close(&watch);
	assert_true(fired >= 5 && ir.count >= fired && ir.count <= 10);
}

static void switch_chip(const char *live)
{
	char path[160];

	snprintf(path, sizeof(path), "%s/live", config);
	int fd = open(path, O_WRONLY | O_CLOEXEC);

	assert_true(fd >= 0);
	assert_int_equal(write(fd, live, 1), 1);
	close(fd);
}

static void chip_that_is_pulled_out_is_told_and_opens_again_when_it_is_back(void **state)
{
	struct trigger *trigger = open_trigger(address);
	int64_t until_ns;
	struct edge edge;
	int err;

	(void)state;
	arm(trigger);
	for (int i = 0; i < 3; i++)
		next_edge(trigger);
	switch_chip("0");
	until_ns = clock_now_ns() + PATIENCE_NS;
	do
		err = driver->next(trigger, 100 * NS_PER_MS, &edge);
	while ((err == 0 || err == -ETIMEDOUT) && clock_now_ns() < until_ns);
	assert_int_equal(err, -ENODEV);
	driver->disarm(trigger);
	driver->close(trigger);
	assert_refused(address, -ENODEV, chip, "no GPIO chip");
	switch_chip("1");
	trigger = open_trigger(address);
	arm(trigger);
	next_edge(trigger);
	driver->close(trigger);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_reported_is_what_was_on_the_wires),
		cmocka_unit_test(strobe_is_dark_when_the_trigger_is_closed_in_mid_pulse),
		cmocka_unit_test(chip_or_line_that_is_not_there_is_named_with_those_that_are),
		cmocka_unit_test(line_that_another_program_has_is_busy),
		cmocka_unit_test(edges_of_an_input_pace_the_shots),
		cmocka_unit_test(chip_that_is_pulled_out_is_told_and_opens_again_when_it_is_back),
	};

	if (argc != 4) {
		fprintf(stderr, "usage: %s CHIP DEVICE CONFIG\n", argv[0]);
		return EXIT_FAILURE;
	}
	chip = argv[1];
	device = argv[2];
	config = argv[3];
	snprintf(address, sizeof(address), "%s,ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG", chip);
	snprintf(genlocked, sizeof(genlocked), "%s,ir=IR_TRIG,genlock=SYNC_IN", chip);
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
