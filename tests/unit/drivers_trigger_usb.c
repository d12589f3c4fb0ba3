/*
 * The USB trigger on an adapter that is a part of the test: what it tells is what was on the lines,
 * to the microsecond, whatever the thread that refills does.
 */
#include "drivers/usb/trigger_usb.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/usb/fake_ft232h.h"
#include "usual_plan.h"

#define SAMPLES 8333
#define IR (1 << 5)
#define STROBE (1 << 6)
#define HD (1 << 7)
#define SHOTS_MAX 200
#define TRIES 3

static struct trigger *trigger;
static struct diag diag;

static int begin(void **state)
{
	(void)state;
	fake_ft232h_reset();
	trigger = NULL;
	return usb_trigger_driver.open(&trigger, "FAKE", &diag);
}

static int end(void **state)
{
	(void)state;
	usb_trigger_driver.close(trigger);
	diag_finish(&diag);
	return 0;
}

static void arm(void)
{
	if (usb_trigger_driver.arm(trigger, &usual_plan, &diag))
		fail_msg("%s", diag.text);
}

static struct edge take(void)
{
	struct edge edge;
	int err, tries = 0;

	do
		err = usb_trigger_driver.next(trigger, 100 * NS_PER_MS, &edge);
	while (err == -ETIMEDOUT && ++tries < 100);
	assert_int_equal(err, 0);
	return edge;
}

static bool has_underrun(const struct edge *edge)
{
	return edge->events >> PULSE_UNDERRUN & 1;
}

/* The change that lights a line after one, or -1. */
static int find_rise(uint8_t bit, int from)
{
	for (int c = from; c < fake_ft232h->change_count; c++)
		if (fake_ft232h->changes[c].levels & bit &&
		    !(c ? fake_ft232h->changes[c - 1].levels & bit : 0))
			return c;
	return -1;
}

static int find_fall(uint8_t bit, int rise)
{
	for (int c = rise; c < fake_ft232h->change_count; c++)
		if (!(fake_ft232h->changes[c].levels & bit))
			return c;
	return -1;
}

static int64_t sample(int change)
{
	assert_true(change >= 0);
	return fake_ft232h->changes[change].sample;
}

/* A shot's lines from its IR pulse on; `ir` is that of the change. */
static void check_lines(const struct edge *edge, int ir)
{
	int64_t begin = sample(ir) - 20;
	int strobe = find_rise(STROBE, ir), hd = find_rise(HD, ir);
	bool fired = hd >= 0 && sample(hd) < begin + SAMPLES;

	assert_int_equal(sample(find_fall(IR, ir)) - begin, 420);
	assert_int_equal(sample(strobe) - begin, 70);
	assert_int_equal(sample(find_fall(STROBE, strobe)) - begin, 320);
	assert_int_equal(fired, edge->shot % 4 == 1);
	if (fired)
		assert_int_equal(sample(hd) - begin, 3000);
	if (fired)
		assert_int_equal(sample(find_fall(HD, hd)) - begin, 3511);
}

/* Every edge told has its pulses, and there are no more. */
static void check_shots(const struct edge *edges, int count)
{
	int ir = find_rise(IR, 0);

	for (int e = 0; e < count; e++) {
		while (ir >= 0 &&
		       fake_ft232h->changes[ir].time_ns < edges[e].edge_ns - USUAL_PERIOD_NS / 2)
			ir = find_rise(IR, ir + 1);
		assert_true(ir >= 0);
		int64_t off_ns =
			fake_ft232h->changes[ir].time_ns - 20 * NS_PER_US - edges[e].edge_ns;

		if (llabs(off_ns) > edges[e].uncertainty_ns)
			fail_msg("shot %d: %ld ns off, told %ld", (int)edges[e].shot, (long)off_ns,
				 (long)edges[e].uncertainty_ns);
		check_lines(&edges[e], ir);
		if (edges[e].shot)
			assert_int_equal(edges[e].shot, edges[e - 1].shot + 1 + edges[e].missed);
		assert_true(!edges[e].missed || has_underrun(&edges[e]));
	}
	assert_int_equal(fake_ft232h->lit_count, 0);
}

static void edges_are_exact_to_the_microsecond_before_and_after_a_stop(void **state)
{
	static struct edge edges[SHOTS_MAX];
	int count = 0;

	(void)state;
	fake_ft232h->ppm = 70;
	for (int run = 0; run < 3; run++) {
		arm();
		for (int i = 0; i < 41; i++)
			edges[count++] = take();
		usb_trigger_driver.disarm(trigger);
		int last = fake_ft232h->change_count - 1;
		assert_true(clock_now_ns() >= fake_ft232h->changes[last].time_ns);
		assert_int_equal(fake_ft232h->changes[last].levels, 0);
	}
	check_shots(edges, count);
}

/* Tried again: a busy machine may stand still for longer by itself. */
static void thread_that_stands_still_for_50_ms_loses_nothing(void **state)
{
	static struct edge edges[SHOTS_MAX];
	bool whole = false;

	(void)state;
	for (int try = 0; try < TRIES && !whole; try++) {
		fake_ft232h_reset();
		arm();
		for (int i = 0; i < 60; i++) {
			if (i == 20)
				fake_ft232h->deaf_until_ns = clock_now_ns() + 50 * NS_PER_MS;
			edges[i] = take();
		}
		usb_trigger_driver.disarm(trigger);
		check_shots(edges, 59); /* the last is still going on */
		whole = edges[59].shot == 59;
	}
	assert_true(whole);
}

static void longer_stall_is_an_underrun_and_the_grid_stays(void **state)
{
	static struct edge edges[SHOTS_MAX];
	uint32_t underruns = 0;

	(void)state;
	arm();
	for (int i = 0; i < 60; i++) {
		if (i == 10)
			fake_ft232h->deaf_until_ns = clock_now_ns() + 600 * NS_PER_MS;
		edges[i] = take();
		underruns += has_underrun(&edges[i]);
	}
	check_shots(edges, 59); /* the last is still going on */
	assert_true(underruns >= 1);
	int64_t passed_ns = edges[59].edge_ns - edges[0].edge_ns;
	assert_true(llabs(passed_ns - (int64_t)(edges[59].shot - edges[0].shot) * USUAL_PERIOD_NS) <
		    edges[59].uncertainty_ns + edges[0].uncertainty_ns);
}

static void adapter_that_is_unplugged_is_told(void **state)
{
	struct edge edge;
	int err = 0;

	(void)state;
	arm();
	take();
	fake_ft232h->gone = 1;
	for (int i = 0; i < 100 && (err == 0 || err == -ETIMEDOUT); i++)
		err = usb_trigger_driver.next(trigger, 100 * NS_PER_MS, &edge);
	assert_int_equal(err, -ENODEV);
	usb_trigger_driver.disarm(trigger);
	assert_int_equal(usb_trigger_driver.arm(trigger, &usual_plan, &diag), -ENODEV);
	assert_non_null(strstr(diag.text, "plug it in anew"));
}

static void address_that_cannot_be_is_refused_with_what_to_write(void **state)
{
	static const struct {
		const char *rest, *word;
	} cases[] = {
		{"FAKE,strobe=D0", "take D1, D3, D5, D6 or D7"},
		{"FAKE,ir=D8", "D0 to D7"},
		{"FAKE,ir=5", "D0 to D7"},
		{"FAKE,flash=D5", "none of ir, strobe and hd"},
		{"FAKE,ir=D5,hd=D5", "given twice"},
		{"FAKE,ir=D5,ir=D6", "given twice"},
		{"FAKE,D5", "write usb:SERIAL"},
	};

	(void)state;
	for (size_t c = 0; c < sizeof(cases) / sizeof(cases[0]); c++) {
		struct diag told = {0};

		assert_int_equal(usb_trigger_driver.check(cases[c].rest, &usual_plan, &told),
				 -EINVAL);
		assert_int_equal(told.count, 1);
		if (!strstr(told.text, cases[c].word))
			fail_msg("%s: %s", cases[c].rest, told.text);
		diag_finish(&told);
	}
	assert_int_equal(usb_trigger_driver.check("", &usual_plan, NULL), 0);
	assert_int_equal(usb_trigger_driver.check("strobe=D1", &usual_plan, NULL), 0);
	assert_int_equal(usb_trigger_driver.check("1-2.4,ir=D0", &usual_plan, NULL), 0);
}

int main(void)
{
#define OPEN(name) cmocka_unit_test_setup_teardown(name, begin, end)
	const struct CMUnitTest tests[] = {
		OPEN(edges_are_exact_to_the_microsecond_before_and_after_a_stop),
		OPEN(thread_that_stands_still_for_50_ms_loses_nothing),
		OPEN(longer_stall_is_an_underrun_and_the_grid_stays),
		OPEN(adapter_that_is_unplugged_is_told),
		cmocka_unit_test(address_that_cannot_be_is_refused_with_what_to_write),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
