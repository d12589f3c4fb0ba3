/*
 * The samples of a USB trigger, for many plans: where the edges are, and that every packet on the
 * wire ends with all lines low.
 */
#include "drivers/usb/usb_wave.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "drivers/trigger_plan.h"
#include "usual_plan.h"

#define PACKET 512
#define PLANS 2000
#define IR 1
#define STROBE 2
#define HD 4

static const uint8_t bits[PULSE_LINE_COUNT] = {
	[PULSE_IR] = IR, [PULSE_STROBE] = STROBE, [PULSE_HD] = HD};

static struct usb_wave make(const struct trigger_plan *plan)
{
	struct usb_wave wave;
	struct diag diag = {0};

	if (usb_wave_make(&wave, plan, bits, PACKET, "trigger usb", &diag))
		fail_msg("%s", diag.text);
	return wave;
}

static int64_t between(struct rng *rng, int64_t low, int64_t high)
{
	return low + (int64_t)(rng_uniform(rng) * (double)(high - low));
}

/* Any plan that could be. */
static struct trigger_plan draw_plan(struct rng *rng)
{
	struct trigger_plan plan = {.hd_divider = 4, .strobe_duty_max = 1.0};

	plan.period_ns = between(rng, 2 * NS_PER_MS, 300 * NS_PER_MS);
	plan.ir_delay_ns = between(rng, 0, plan.period_ns / 8);
	plan.ir_exposure_ns = between(rng, 1, plan.period_ns / 3);
	plan.strobe_delay_ns = plan.ir_delay_ns + between(rng, 0, plan.ir_exposure_ns / 2);
	plan.strobe_width_ns = between(rng, 0, plan.ir_exposure_ns / 2);
	plan.hd_phase = (int)between(rng, 0, 4);
	plan.hd_delay_ns = between(rng, 0, plan.period_ns - NS_PER_MS);
	plan.hd_exposure_ns = between(rng, 1, 3 * plan.period_ns);
	return plan;
}

static void check_packets(const struct usb_wave *wave, uint64_t shot, uint32_t length)
{
	uint32_t cuts[USB_WAVE_CUTS_MAX];
	uint32_t count = usb_wave_cut(wave, shot, length, cuts), at = 0;
	uint8_t *samples = malloc(length);

	assert_non_null(samples);
	memset(samples, 0xff, length);
	usb_wave_fill(wave, shot, samples, length);
	assert_in_range(count, 1, USB_WAVE_CUTS_MAX);
	for (uint32_t c = 0; c < count; c++) {
		uint32_t end = at + cuts[c];

		assert_true(cuts[c] > 0 && end <= length);
		for (; at < end; at += PACKET < end - at ? PACKET : end - at)
			assert_int_equal(samples[(PACKET < end - at ? at + PACKET : end) - 1], 0);
	}
	assert_int_equal(at, length);
	free(samples);
}

static void every_packet_ends_with_all_lines_low(void **state)
{
	struct rng rng;
	int made = 0;

	(void)state;
	rng_init(&rng, 1, 0);
	for (int p = 0; p < PLANS; p++) {
		struct trigger_plan plan = draw_plan(&rng);
		struct usb_wave wave;

		if (usb_wave_make(&wave, &plan, bits, PACKET, "trigger usb", NULL))
			continue;
		made++;
		for (uint64_t shot = 0; shot < 4; shot++)
			for (int off = -1; off <= 1; off++)
				check_packets(&wave, shot,
					      wave.period + (uint32_t)off * wave.slack);
	}
	assert_true(made > PLANS / 2);
}

/* Begin and end of the only pulse of a line in a shot; none: 0 and 0. */
static struct usb_pulse find_pulse(const struct usb_wave *wave, uint64_t shot, uint8_t bit)
{
	static uint8_t samples[USB_WAVE_PERIOD_MAX];
	struct usb_pulse found = {0};
	int rises = 0;

	usb_wave_fill(wave, shot, samples, wave->period);
	for (uint32_t s = 0; s < wave->period; s++) {
		bool was = s && samples[s - 1] & bit;

		if (samples[s] & bit && !was) {
			found.begin = s;
			rises++;
		}
		if (!(samples[s] & bit) && was)
			found.end = s;
	}
	assert_true(rises <= 1);
	return found;
}

static void assert_edge(const struct usb_wave *wave, uint32_t sample, int64_t wanted_ns)
{
	int64_t off_ns = usb_wave_ns(wave->divisor, sample) - wanted_ns;

	assert_true(2 * llabs(off_ns) <= usb_wave_ns(wave->divisor, 1) + 2);
}

static void edges_are_where_the_plan_has_them_to_the_nearest_sample(void **state)
{
	struct rng rng;

	(void)state;
	rng_init(&rng, 2, 0);
	for (int p = 0; p < 200; p++) {
		struct trigger_plan plan = p ? draw_plan(&rng) : usual_plan;
		struct usb_wave wave;

		if (usb_wave_make(&wave, &plan, bits, PACKET, "trigger usb", NULL))
			continue;
		int64_t sample_ns = usb_wave_ns(wave.divisor, 1) + 1;
		struct usb_pulse ir = find_pulse(&wave, 0, IR);
		struct usb_pulse strobe = find_pulse(&wave, 0, STROBE);
		struct usb_pulse hd = find_pulse(&wave, (uint64_t)plan.hd_phase, HD);

		assert_edge(&wave, ir.begin, plan.ir_delay_ns);
		assert_edge(&wave, hd.begin, plan.hd_delay_ns);
		assert_true(hd.end > hd.begin);
		if (!plan.strobe_width_ns)
			continue;
		int64_t burnt_ns = usb_wave_ns(wave.divisor, strobe.end - strobe.begin);

		assert_edge(&wave, strobe.begin, plan.strobe_delay_ns);
		assert_true(burnt_ns <= plan.strobe_width_ns);
		assert_true(burnt_ns > plan.strobe_width_ns - sample_ns);
	}
}

static void a_usual_plan_has_samples_of_a_microsecond(void **state)
{
	struct usb_wave wave = make(&usual_plan);

	(void)state;
	assert_int_equal(usb_wave_ns(wave.divisor, 1), NS_PER_US);
	assert_int_equal(wave.period, 8333);
	assert_int_equal(wave.edge_off_ns, 0);
	struct usb_pulse strobe = find_pulse(&wave, 7, STROBE);
	assert_int_equal(strobe.begin, 70);
	assert_int_equal(strobe.end, 320);
}

static void hd_pulses_come_in_the_shots_of_their_phase_only(void **state)
{
	struct trigger_plan plan = usual_plan;

	(void)state;
	for (plan.hd_phase = 0; plan.hd_phase < 4; plan.hd_phase++)
		for (plan.hd_delay_ns = 0; plan.hd_delay_ns < plan.period_ns - NS_PER_MS;
		     plan.hd_delay_ns += 300 * NS_PER_US) {
			struct usb_wave wave = make(&plan);

			for (uint64_t shot = 0; shot < 12; shot++)
				assert_int_equal(find_pulse(&wave, shot, HD).end > 0,
						 shot % 4 == (uint64_t)plan.hd_phase);
		}
}

/* The middle of the light of a strobe whose width is no whole number of samples. */
static void time_of_the_shot_is_that_of_the_light_there_is(void **state)
{
	struct trigger_plan plan = usual_plan;

	(void)state;
	plan.period_ns = NS_PER_S / 5;
	plan.ir_exposure_ns = 60 * NS_PER_MS;
	plan.strobe_width_ns = 33333333;
	plan.strobe_duty_max = 0.5;
	struct usb_wave wave = make(&plan);
	struct usb_pulse strobe = find_pulse(&wave, 0, STROBE);
	int64_t middle_ns =
		(usb_wave_ns(wave.divisor, strobe.begin) + usb_wave_ns(wave.divisor, strobe.end)) /
		2;

	assert_true(llabs(wave.edge_off_ns + trigger_plan_ir_middle_ns(&plan) - middle_ns) <= 1);
	assert_int_not_equal(wave.edge_off_ns, 0);
}

static void assert_refused(const struct trigger_plan *plan, const char *word)
{
	struct usb_wave wave;
	struct diag diag = {0};

	assert_int_equal(usb_wave_make(&wave, plan, bits, PACKET, "trigger usb:A", &diag), -EINVAL);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "trigger usb:A: the plan's "));
	assert_non_null(strstr(diag.text, word));
	diag_finish(&diag);
}

static void a_plan_that_fits_no_packet_is_refused_with_the_bound(void **state)
{
	struct trigger_plan plan = usual_plan;

	(void)state;
	plan.ir_exposure_ns = 5 * NS_PER_MS; /* over half a period */
	assert_refused(&plan, "exposure");
	plan = usual_plan;
	plan.period_ns = NS_PER_S;
	plan.ir_exposure_ns = 200 * NS_PER_MS; /* slower than the slowest clock */
	assert_refused(&plan, "exposure");
	plan = usual_plan;
	plan.hd_delay_ns = plan.period_ns + NS_PER_MS;
	assert_refused(&plan, "hd.delay");
	plan = usual_plan;
	plan.ir_exposure_ns = 2 * NS_PER_MS;
	plan.strobe_width_ns = NS_PER_US;
	assert_refused(&plan, "strobe_width");
}

static void lines_that_are_not_wired_stay_low(void **state)
{
	const uint8_t only_ir[PULSE_LINE_COUNT] = {[PULSE_IR] = IR};
	struct usb_wave wave;

	(void)state;
	assert_int_equal(usb_wave_make(&wave, &usual_plan, only_ir, PACKET, "trigger usb", NULL),
			 0);
	for (uint64_t shot = 0; shot < 4; shot++)
		assert_int_equal(find_pulse(&wave, shot, (uint8_t)~IR).end, 0);
	assert_int_equal(find_pulse(&wave, 0, IR).begin, 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_packet_ends_with_all_lines_low),
		cmocka_unit_test(edges_are_where_the_plan_has_them_to_the_nearest_sample),
		cmocka_unit_test(a_usual_plan_has_samples_of_a_microsecond),
		cmocka_unit_test(hd_pulses_come_in_the_shots_of_their_phase_only),
		cmocka_unit_test(time_of_the_shot_is_that_of_the_light_there_is),
		cmocka_unit_test(a_plan_that_fits_no_packet_is_refused_with_the_bound),
		cmocka_unit_test(lines_that_are_not_wired_stay_low),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
