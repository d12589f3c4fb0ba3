/*
 * The usb trigger on emulated adapters: usb_trigger BUILD. Truth is what the emulator (bit_bang.c)
 * had on its lines, sample by sample. The kernel's serial driver is loaded, and takes every
 * adapter.
 */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/usb/trigger_usb.h"
#include "drivers/usb/usb_wave.h"
#include "tests/hil/bit_bang_plug.h"
#include "tests/hil/bit_bang_trace.h"

#define SHOTS 50     /* in 10 s */
#define STALL_MS 300 /* more than the adapter's memory and the emulator's patience */
#define LONG_STALL_MS 2000
#define STALLED_SHOTS 16
#define TRIES 3
#define STILL_NS (100 * NS_PER_MS)
#define BEGIN_NS (100 * NS_PER_MS) /* the emulator sees the beginning as late as that */
#define TRACE_NS (1 * NS_PER_MS)
#define PATIENCE_NS (10 * NS_PER_S)
#define PACKET_BYTES 512
#define TRACE "/tmp/bit_bang.trace"
#define PPM "80"
#define IR (1 << 5)
#define STROBE (1 << 6)
#define HD (1 << 7)
#define ADAPTERS 2

static const struct trigger_driver *const driver = &usb_trigger_driver;
static const uint8_t bits[PULSE_LINE_COUNT] = {IR, STROBE, HD};
static const char *build;
static pid_t adapters[ADAPTERS];
static struct bit_bang_trace trace;

static const struct trigger_plan plan = {
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

static void plug_in(int index, const char *serial, const char *product)
{
	adapters[index] =
		bit_bang_plug_in(build, index, serial, product, PPM, index ? "/dev/null" : TRACE);
	assert_true(adapters[index] > 0);
}

static int begin(void **state)
{
	(void)state;
	unlink(TRACE);
	plug_in(0, "EMU0", "6014");
	return 0;
}

static int end(void **state)
{
	(void)state;
	for (int a = 0; a < ADAPTERS; a++)
		bit_bang_unplug(&adapters[a]);
	return 0;
}

static void wait_ms(int64_t time_ms)
{
	clock_sleep_until(clock_now_ns() + time_ms * NS_PER_MS);
}

/* What is said within PATIENCE_NS: the kernel takes a while to see what was plugged in or out. */
static void await_refusal(const char *rest, int err, const char *word, const char *other)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	bool told = false;

	while (!told) {
		struct trigger *trigger = NULL;
		struct diag diag = {0};
		int got = driver->open(&trigger, rest, &diag);

		told = got == err && diag.count == 1 && strstr(diag.text, word) &&
		       strstr(diag.text, other);
		if (told)
			print_message("# %s", diag.text);
		else if (clock_now_ns() > until_ns)
			fail_msg("%s: %d, %s", rest, got, diag.text ? diag.text : "nothing");
		diag_finish(&diag);
		driver->close(trigger);
		if (!told)
			wait_ms(100);
	}
}

static struct trigger *await_trigger(const char *rest)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	struct trigger *trigger = NULL;
	struct diag diag = {0};

	while (driver->open(&trigger, rest, &diag) && clock_now_ns() < until_ns) {
		diag_finish(&diag);
		wait_ms(100);
	}
	if (!trigger)
		fail_msg("%s: %s", rest, diag.text);
	diag_finish(&diag);
	return trigger;
}

static void arm(struct trigger *trigger)
{
	struct diag diag = {0};

	if (driver->arm(trigger, &plan, &diag))
		fail_msg("%s", diag.text);
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

static bool has_event(const struct edge *edge, enum pulse_event event)
{
	return edge->events >> event & 1;
}

/* Every sample of every pulse, and when it was by the clock, but for the time that the emulator was
 * late to see the stream begin. */
static void check_shots(const struct edge *edges, int count)
{
	static struct bit_bang_pulse irs[BIT_BANG_RECORDS_MAX], strobes[BIT_BANG_RECORDS_MAX],
		hds[BIT_BANG_RECORDS_MAX];
	int ir_count = bit_bang_trace_pulses(&trace, IR, irs, BIT_BANG_RECORDS_MAX);
	int strobe_count = bit_bang_trace_pulses(&trace, STROBE, strobes, BIT_BANG_RECORDS_MAX);
	int hd_count = bit_bang_trace_pulses(&trace, HD, hds, BIT_BANG_RECORDS_MAX);
	int64_t worst_ns = 0, bound_ns = 0, late_ns = 0;
	struct usb_wave wave;
	int i = 0, h = 0;

	assert_int_equal(usb_wave_make(&wave, &plan, bits, PACKET_BYTES, "", NULL), 0);
	assert_int_equal(ir_count, strobe_count);
	for (int e = 0; e < count; e++) {
		int64_t begin_ns = edges[e].edge_ns - wave.edge_off_ns;

		while (i < ir_count && irs[i].begin_ns < begin_ns - plan.period_ns / 2)
			i++;
		assert_true(i < ir_count);
		int64_t begin = irs[i].begin, off_ns = irs[i].begin_ns - begin_ns;

		if (e == 0 || edges[e].shot == 0 || has_event(&edges[e], PULSE_UNDERRUN)) {
			late_ns = off_ns;
			assert_in_range(off_ns + BEGIN_NS / 10, 0, BEGIN_NS);
		}
		off_ns = llabs(off_ns - late_ns);
		if (off_ns > edges[e].uncertainty_ns + TRACE_NS)
			bit_bang_trace_print_gaps(&trace, edges[e].edge_ns);
		if (off_ns > edges[e].uncertainty_ns + TRACE_NS)
			fail_msg("shot %d: %ld ns off, told %ld", (int)edges[e].shot, (long)off_ns,
				 (long)edges[e].uncertainty_ns);
		worst_ns = off_ns > worst_ns ? off_ns : worst_ns;
		bound_ns = edges[e].uncertainty_ns;
		assert_int_equal(irs[i].end - begin, wave.pulses[PULSE_IR].end);
		assert_int_equal(strobes[i].begin - begin, wave.pulses[PULSE_STROBE].begin);
		assert_int_equal(strobes[i].end - begin, wave.pulses[PULSE_STROBE].end);
		while (h < hd_count && hds[h].begin < begin)
			h++;
		bool fired = h < hd_count && hds[h].begin < begin + wave.period;
		assert_int_equal(fired, edges[e].shot % 4 == 1);
		if (fired)
			assert_int_equal(hds[h].begin - begin, wave.pulses[PULSE_HD].begin);
		if (fired)
			assert_int_equal(hds[h].end - begin, wave.pulses[PULSE_HD].end);
		if (edges[e].shot && !edges[e].missed)
			assert_in_range(begin - irs[i - 1].begin, wave.period - wave.slack,
					wave.period + wave.slack);
	}
	print_message("# %d shots, %.2f ms from the truth at most, bound %.2f ms\n", count,
		      (double)worst_ns / NS_PER_MS, (double)bound_ns / NS_PER_MS);
	assert_int_equal(bit_bang_trace_count(&trace, BIT_BANG_LIT), 0);
}

/* A helper stops this process, every thread of it, and lets it go on. */
static void stand_still(int64_t time_ms)
{
	pid_t self = getpid(), helper = fork();

	if (helper == 0) {
		kill(self, SIGSTOP);
		wait_ms(time_ms);
		kill(self, SIGCONT);
		_exit(0);
	}
	assert_true(helper > 0);
	waitpid(helper, NULL, 0);
}

/* A run on a machine that stood still itself says nothing: it is done again. */
static bool is_worth_nothing(int *tries, const struct edge *edges, int count)
{
	bit_bang_trace_read(&trace, TRACE);
	int64_t still_ns =
		bit_bang_trace_stillness(&trace, edges[0].edge_ns, edges[count - 1].edge_ns);
	int unsure = 0; /* also when the stream began, which then is hardly known */

	for (int e = 1; e < count; e++)
		if (edges[e].uncertainty_ns > edges[unsure].uncertainty_ns)
			unsure = e;
	if (edges[unsure].uncertainty_ns > STILL_NS / 2) {
		print_message("# edge %d of %d is known to %.1f ms, by the beat it stood still for "
			      "%.1f\n",
			      unsure, count, (double)edges[unsure].uncertainty_ns / NS_PER_MS,
			      (double)still_ns / NS_PER_MS);
		if (still_ns < 2 * edges[unsure].uncertainty_ns)
			still_ns = 2 * edges[unsure].uncertainty_ns;
	}
	if (still_ns <= STILL_NS)
		return false;
	print_message("# this machine stood still for %d ms: %s\n", (int)(still_ns / NS_PER_MS),
		      *tries + 1 < TRIES ? "once more" : "at every try");
	assert_int_equal(truncate(TRACE, 0), 0);
	return ++*tries < TRIES;
}

/* Two runs; the second begins at no multiple of four. */
static int run_twice(struct trigger *trigger, struct edge edges[2 * SHOTS])
{
	int count = 0;

	for (int run = 0; run < 2; run++) {
		int last = run ? count + 8 : SHOTS + 1;

		arm(trigger);
		while (count < last) {
			edges[count] = next_edge(trigger);
			if (++count == SHOTS / 2)
				stand_still(STALL_MS);
		}
		driver->disarm(trigger);
	}
	return count;
}

static void edges_are_exact_to_the_sample_for_ten_seconds_and_after_a_restart(void **state)
{
	static struct edge edges[2 * SHOTS];
	struct trigger *trigger = await_trigger("EMU0");
	int count, tries = 0;

	(void)state;
	do
		count = run_twice(trigger, edges);
	while (is_worth_nothing(&tries, edges, count));
	driver->close(trigger);
	assert_true(tries < TRIES);
	for (int i = 0; i < count; i++) {
		assert_int_equal(edges[i].shot, i > SHOTS ? i - SHOTS - 1 : i);
		assert_int_equal(edges[i].missed, 0);
		assert_int_equal(edges[i].events, 0);
	}
	check_shots(edges, count);
	assert_int_equal(bit_bang_trace_gaps(&trace, edges[0].edge_ns, edges[SHOTS].edge_ns), 0);
	assert_int_equal(
		bit_bang_trace_gaps(&trace, edges[SHOTS + 1].edge_ns, edges[count - 1].edge_ns), 0);
}

static void run_stalled(struct trigger *trigger, struct edge edges[STALLED_SHOTS])
{
	arm(trigger);
	for (int i = 0; i < STALLED_SHOTS; i++) {
		edges[i] = next_edge(trigger);
		if (i == 6)
			stand_still(LONG_STALL_MS);
	}
	driver->disarm(trigger);
}

static void longer_stall_is_named_and_shots_go_on_by_their_time(void **state)
{
	static struct edge edges[STALLED_SHOTS];
	const struct edge *first = &edges[0], *last = &edges[STALLED_SHOTS - 1];
	struct trigger *trigger = await_trigger("EMU0");
	uint32_t missed = 0, underruns = 0;
	int tries = 0;

	(void)state;
	do
		run_stalled(trigger, edges);
	while (is_worth_nothing(&tries, edges, STALLED_SHOTS));
	driver->close(trigger);
	assert_true(tries < TRIES);
	for (int i = 0; i < STALLED_SHOTS; i++) {
		missed += edges[i].missed;
		underruns += has_event(&edges[i], PULSE_UNDERRUN);
		if (i)
			assert_int_equal(edges[i].shot, edges[i - 1].shot + 1 + edges[i].missed);
	}
	check_shots(edges, STALLED_SHOTS);
	print_message("# %u missed in %d ms\n", missed, LONG_STALL_MS);
	assert_in_range(missed, 5, 20);
	assert_int_equal(underruns, 1);
	int64_t passed_ns = (int64_t)(last->shot - first->shot) * plan.period_ns;
	assert_true(llabs(last->edge_ns - first->edge_ns - passed_ns) <
		    last->uncertainty_ns + first->uncertainty_ns + TRACE_NS);
}

static void adapters_are_told_apart_by_their_serial_numbers(void **state)
{
	struct trigger *trigger;

	(void)state;
	plug_in(1, "EMU1", "6014");
	await_refusal("", -EINVAL, "there are 2 adapters", "EMU1");
	trigger = await_trigger("EMU1,strobe=D3");
	await_refusal("EMU1", -EBUSY, "another program", "EMU1");
	await_refusal("EMU2", -ENODEV, "no such adapter", "EMU0");
	driver->close(trigger);
	driver->close(await_trigger("EMU0"));
}

static void wrong_chip_is_named_and_so_is_none(void **state)
{
	(void)state;
	bit_bang_unplug(&adapters[0]);
	await_refusal("EMU0", -ENODEV, "no FT232H adapter", "plug one in");
	plug_in(0, "EMU0", "6001");
	await_refusal("EMU0", -ENODEV, "FT232R (0403:6001)", "plug in an FT232H");
}

static void await_serial_port(bool wanted)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;

	while ((access("/dev/ttyUSB0", F_OK) == 0) != wanted && clock_now_ns() < until_ns)
		wait_ms(50);
	assert_int_equal(access("/dev/ttyUSB0", F_OK) == 0, wanted);
}

static void serial_driver_lets_go_and_does_not_come_back(void **state)
{
	struct trigger *trigger;

	(void)state;
	await_serial_port(true);
	trigger = await_trigger("EMU0");
	await_serial_port(false);
	driver->close(trigger);
	wait_ms(300);
	await_serial_port(false);
	driver->close(await_trigger("EMU0"));
}

/* As a user who may not. */
static void adapter_that_may_not_be_opened_is_told_with_the_group(void **state)
{
	int status;

	(void)state;
	driver->close(await_trigger("EMU0"));
	pid_t child = fork();

	if (child == 0) {
		struct trigger *trigger = NULL;
		struct diag diag = {0};

		if (setuid(65534))
			_exit(2);
		int err = driver->open(&trigger, "EMU0", &diag);
		_exit(err == -EACCES && diag.count == 1 && strstr(diag.text, "stage-operator") ? 0
											       : 1);
	}
	waitpid(child, &status, 0);
	assert_int_equal(status, 0);
}

static void adapter_that_is_unplugged_is_told_and_opens_again_when_it_is_back(void **state)
{
	struct trigger *trigger = await_trigger("EMU0");
	int64_t until_ns;
	struct edge edge;
	int err;

	(void)state;
	arm(trigger);
	for (int i = 0; i < 3; i++)
		next_edge(trigger);
	bit_bang_unplug(&adapters[0]);
	until_ns = clock_now_ns() + PATIENCE_NS;
	do
		err = driver->next(trigger, 100 * NS_PER_MS, &edge);
	while ((err == 0 || err == -ETIMEDOUT) && clock_now_ns() < until_ns);
	assert_true(err == -ENODEV || err == -EIO);
	driver->disarm(trigger);
	driver->close(trigger);
	await_refusal("EMU0", -ENODEV, "no FT232H adapter", "plug one in");
	plug_in(0, "EMU0", "6014");
	trigger = await_trigger("EMU0");
	arm(trigger);
	next_edge(trigger);
	driver->close(trigger);
}

static pid_t start_victim(void)
{
	pid_t child = fork();

	if (child == 0) {
		struct trigger *trigger = await_trigger("EMU0");
		struct edge edge;

		arm(trigger);
		for (;;)
			driver->next(trigger, 100 * NS_PER_MS, &edge);
	}
	assert_true(child > 0);
	return child;
}

/* Until its pulses are on the lines. */
static void await_pulses(int64_t started_ns)
{
	int64_t until_ns = started_ns + PATIENCE_NS;

	do {
		assert_true(clock_now_ns() < until_ns);
		wait_ms(20);
		bit_bang_trace_read(&trace, TRACE);
	} while (bit_bang_trace_last_change(&trace)->time_ns < started_ns);
}

/* At different times of a shot. What the kernel still has on its way may be put out. */
static void lines_of_a_killed_process_are_dark(void **state)
{
	(void)state;
	driver->close(await_trigger("EMU0"));
	for (int i = 0; i < 3; i++) {
		int64_t started_ns = clock_now_ns();
		pid_t victim = start_victim();

		await_pulses(started_ns);
		wait_ms(60 * i);
		kill(victim, SIGKILL);
		waitpid(victim, NULL, 0);
		int64_t dead_ns = clock_now_ns();
		wait_ms(400);
		bit_bang_trace_read(&trace, TRACE);
		const struct bit_bang_record *last = bit_bang_trace_last_change(&trace);

		assert_int_equal(last->levels, 0);
		assert_true(last->time_ns < dead_ns + plan.period_ns);
		assert_int_equal(bit_bang_trace_count(&trace, BIT_BANG_LIT), 0);
	}
}

int main(int argc, char **argv)
{
#define PLUGGED(name) cmocka_unit_test_setup_teardown(name, begin, end)
	const struct CMUnitTest tests[] = {
		PLUGGED(serial_driver_lets_go_and_does_not_come_back),
		PLUGGED(edges_are_exact_to_the_sample_for_ten_seconds_and_after_a_restart),
		PLUGGED(longer_stall_is_named_and_shots_go_on_by_their_time),
		PLUGGED(adapters_are_told_apart_by_their_serial_numbers),
		PLUGGED(wrong_chip_is_named_and_so_is_none),
		PLUGGED(adapter_that_may_not_be_opened_is_told_with_the_group),
		PLUGGED(adapter_that_is_unplugged_is_told_and_opens_again_when_it_is_back),
		PLUGGED(lines_of_a_killed_process_are_dark),
	};

	if (argc != 2) {
		fprintf(stderr, "usage: %s BUILD\n", argv[0]);
		return EXIT_FAILURE;
	}
	build = argv[1];
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
