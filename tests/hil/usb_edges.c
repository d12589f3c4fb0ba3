/*
 * Every edge of the usb trigger against what an emulated adapter (bit_bang.c) had on its lines,
 * sample by sample: usb_edges BUILD.
 */
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "drivers/usb/usb_wave.h"
#include "tests/hil/bit_bang_trace.h"
#include "tests/hil/usb_rig.h"

#define SHOTS 50     /* in 10 s */
#define STALL_MS 300 /* more than the adapter's memory */
#define LONG_STALL_MS 2000
#define STALLED_SHOTS 16
#define BEGIN_NS (20 * NS_PER_MS) /* the emulator sees the beginning within that */
#define TRACE_NS (1 * NS_PER_MS)
#define BOUND_NS (5 * NS_PER_MS) /* that no edge may be told worse than, stall or not */
#define PACKET_BYTES 512
#define IR (1 << 5)
#define STROBE (1 << 6)
#define HD (1 << 7)

static const uint8_t bits[PULSE_LINE_COUNT] = {IR, STROBE, HD};
static struct bit_bang_trace trace;

static bool has_event(const struct edge *edge, enum pulse_event event)
{
	return edge->events >> event & 1;
}

/* The pulses that the adapter had on its lines, in turn. */
static struct line {
	struct bit_bang_pulse pulses[BIT_BANG_RECORDS_MAX];
	int count, at;
} ir, strobe, hd;

static void read_line(struct line *line, uint32_t bit)
{
	line->count = bit_bang_trace_pulses(&trace, bit, line->pulses, BIT_BANG_RECORDS_MAX);
	line->at = 0;
}

static void check_pulse(const struct line *line, int64_t begin, struct usb_pulse wanted)
{
	assert_int_equal(line->pulses[line->at].begin - begin, wanted.begin);
	assert_int_equal(line->pulses[line->at].end - begin, wanted.end);
}

/* Returns the first sample of the shot that was told. */
static int64_t check_samples(const struct usb_wave *wave, const struct edge *edge)
{
	int64_t begin_ns = edge->edge_ns - wave->edge_off_ns;

	while (ir.at < ir.count &&
	       ir.pulses[ir.at].begin_ns < begin_ns - usb_rig_plan.period_ns / 2)
		ir.at++;
	assert_true(ir.at < ir.count);
	int64_t begin = ir.pulses[ir.at].begin;

	strobe.at = ir.at;
	check_pulse(&ir, begin, wave->pulses[PULSE_IR]);
	check_pulse(&strobe, begin, wave->pulses[PULSE_STROBE]);
	while (hd.at < hd.count && hd.pulses[hd.at].begin < begin)
		hd.at++;
	bool fired = hd.at < hd.count && hd.pulses[hd.at].begin < begin + wave->period;
	assert_int_equal(fired, edge->shot % 4 == 1);
	if (fired)
		check_pulse(&hd, begin, wave->pulses[PULSE_HD]);
	if (edge->shot && !edge->missed)
		assert_in_range(begin - ir.pulses[ir.at - 1].begin, wave->period - wave->slack,
				wave->period + wave->slack);
	return begin_ns;
}

/* When it was by the clock, but for the time that the emulator was late to see the stream begin.
 * Returns how far that is from what was told. */
static int64_t check_time(const struct edge *edge, int64_t begin_ns, int64_t *late_ns)
{
	int64_t off_ns = ir.pulses[ir.at].begin_ns - begin_ns;

	if (edge->shot == 0 || has_event(edge, PULSE_UNDERRUN)) {
		*late_ns = off_ns;
		assert_in_range(off_ns + BEGIN_NS / 2, 0, BEGIN_NS);
	}
	off_ns = llabs(off_ns - *late_ns);
	if (off_ns > edge->uncertainty_ns + TRACE_NS || edge->uncertainty_ns > BOUND_NS) {
		bit_bang_trace_print_gaps(&trace, edge->edge_ns);
		fail_msg("shot %d: %ld ns off, told %ld", (int)edge->shot, (long)off_ns,
			 (long)edge->uncertainty_ns);
	}
	return off_ns;
}

static void check_shots(const struct edge *edges, int count)
{
	int64_t worst_ns = 0, bound_ns = 0, late_ns = 0;
	struct usb_wave wave;

	bit_bang_trace_read(&trace, USB_RIG_TRACE);
	read_line(&ir, IR);
	read_line(&strobe, STROBE);
	read_line(&hd, HD);
	assert_int_equal(usb_wave_make(&wave, &usb_rig_plan, bits, PACKET_BYTES, "", NULL), 0);
	assert_int_equal(ir.count, strobe.count);
	for (int e = 0; e < count; e++) {
		int64_t begin_ns = check_samples(&wave, &edges[e]);
		int64_t off_ns = check_time(&edges[e], begin_ns, &late_ns);

		worst_ns = off_ns > worst_ns ? off_ns : worst_ns;
		if (edges[e].uncertainty_ns > bound_ns)
			bound_ns = edges[e].uncertainty_ns;
	}
	print_message("# %d shots, %.2f ms from the truth at most, bound %.2f ms at most\n", count,
		      (double)worst_ns / NS_PER_MS, (double)bound_ns / NS_PER_MS);
	assert_int_equal(bit_bang_trace_count(&trace, BIT_BANG_LIT), 0);
}

/* A helper stops this process, every thread of it, and lets it go on. */
static void stand_still(int64_t time_ms)
{
	pid_t self = getpid(), helper = fork();

	if (helper == 0) {
		kill(self, SIGSTOP);
		usb_rig_wait_ms(time_ms);
		kill(self, SIGCONT);
		_exit(0);
	}
	assert_true(helper > 0);
	waitpid(helper, NULL, 0);
}

/* Two runs; the second begins at no multiple of four. */
static int run_twice(struct trigger *trigger, struct edge edges[2 * SHOTS])
{
	int count = 0;

	for (int run = 0; run < 2; run++) {
		int last = run ? count + 8 : SHOTS + 1;

		usb_rig_arm(trigger);
		while (count < last) {
			edges[count] = usb_rig_next_edge(trigger);
			if (++count == SHOTS / 2)
				stand_still(STALL_MS);
		}
		usb_rig_driver->disarm(trigger);
	}
	return count;
}

static void edges_are_exact_to_the_sample_for_ten_seconds_and_after_a_restart(void **state)
{
	static struct edge edges[2 * SHOTS];
	struct trigger *trigger = usb_rig_await("EMU0");

	(void)state;
	int count = run_twice(trigger, edges);

	usb_rig_driver->close(trigger);
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
	usb_rig_arm(trigger);
	for (int i = 0; i < STALLED_SHOTS; i++) {
		edges[i] = usb_rig_next_edge(trigger);
		if (i == 6)
			stand_still(LONG_STALL_MS);
	}
	usb_rig_driver->disarm(trigger);
}

static void longer_stall_is_named_and_shots_go_on_by_their_time(void **state)
{
	static struct edge edges[STALLED_SHOTS];
	const struct edge *first = &edges[0], *last = &edges[STALLED_SHOTS - 1];
	struct trigger *trigger = usb_rig_await("EMU0");
	uint32_t missed = 0, underruns = 0;

	(void)state;
	run_stalled(trigger, edges);
	usb_rig_driver->close(trigger);
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
	int64_t passed_ns = (int64_t)(last->shot - first->shot) * usb_rig_plan.period_ns;
	assert_true(llabs(last->edge_ns - first->edge_ns - passed_ns) <
		    last->uncertainty_ns + first->uncertainty_ns + TRACE_NS);
}

int main(int argc, char **argv)
{
#define PLUGGED(name) cmocka_unit_test_setup_teardown(name, usb_rig_begin, usb_rig_end)
	const struct CMUnitTest tests[] = {
		PLUGGED(edges_are_exact_to_the_sample_for_ten_seconds_and_after_a_restart),
		PLUGGED(longer_stall_is_named_and_shots_go_on_by_their_time),
	};

	if (usb_rig_find_programs(argc, argv))
		return EXIT_FAILURE;
	return cmocka_run_group_tests(tests, NULL, NULL);
}
