/*
 * The GPIO trigger in virtual time, on a chip that is a file: every change of every line is looked
 * at, with threads that wake up late, calls that take long, and inputs that misbehave.
 */
#include "drivers/gpio/trigger_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/clock_virtual.h"
#include "base/rng.h"
#include "tests/gpio/fake_gpio.h"
#include "tests/gpio/fake_guard.h"

#define PERIOD_NS (NS_PER_S / 125)
#define LINES "gpiochip0,ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG"
#define IR 1U
#define STROBE 2U
#define HD 4U

static const struct trigger_plan plan = {
	.period_ns = PERIOD_NS,
	.ir_delay_ns = 20 * NS_PER_US,
	.ir_exposure_ns = 400 * NS_PER_US,
	.strobe_delay_ns = 70 * NS_PER_US,
	.strobe_width_ns = 250 * NS_PER_US,
	.strobe_duty_max = 0.1,
	.hd_divider = 4,
	.hd_phase = 1,
	.hd_delay_ns = 100 * NS_PER_US,
	.hd_exposure_ns = 12 * NS_PER_MS, /* over more than one period */
};

static char dir[] = "/tmp/stage-gpio-XXXXXX";
static struct fake_gpio *chip;
static struct trigger *trigger;
static struct diag diag;

static int begin(void **state)
{
	(void)state;
	chip = fake_gpio_create(dir, "gpiochip0");
	memset(&fake_guard, 0, sizeof(fake_guard));
	clock_virtual_begin(NS_PER_S, CLOCK_NO_LIMIT);
	clock_thread_expect();
	clock_thread_begin();
	trigger = NULL;
	return 0;
}

static int end(void **state)
{
	(void)state;
	gpio_trigger_driver.close(trigger);
	clock_thread_end();
	clock_virtual_end();
	diag_finish(&diag);
	return 0;
}

static int open_lines(const char *lines)
{
	return gpio_trigger_driver.open(&trigger, lines, &diag);
}

static void arm(const char *lines, const struct trigger_plan *with)
{
	if (open_lines(lines) < 0 || gpio_trigger_driver.arm(trigger, with, &diag) < 0)
		fail_msg("%s", diag.text);
	atomic_store(&chip->change_count, 0);
}

static int next(struct edge *edge)
{
	int err;

	do
		err = gpio_trigger_driver.next(trigger, 100 * NS_PER_MS, edge);
	while (err == -ETIMEDOUT);
	return err;
}

static struct edge take(void)
{
	struct edge edge;

	assert_int_equal(next(&edge), 0);
	return edge;
}

/* Runs as long as any of its lines may still be lit. */
static void run_on(int shots)
{
	for (int i = 0; i < shots; i++)
		take();
}

/* A pulse of one line, as the wire had it. */
struct burn {
	int64_t on_ns, off_ns;
};

static int burns_of(uint32_t bit, uint32_t dark_levels, struct burn *burns, int max)
{
	uint32_t was = dark_levels;
	int count = 0;

	for (uint32_t i = 0; i < chip->change_count; i++) {
		const struct fake_gpio_change *change = &chip->changes[i];
		uint32_t turned = (was ^ change->levels) & bit;

		was = change->levels;
		if (!turned)
			continue;
		if ((change->levels ^ dark_levels) & bit) {
			assert_true(count < max);
			burns[count] = (struct burn){change->time_ns, INT64_MAX};
		} else {
			burns[count++].off_ns = change->time_ns;
		}
	}
	return count;
}

#define BURNS_MAX 4096
static struct burn ir[BURNS_MAX], strobe[BURNS_MAX], hd[BURNS_MAX];

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
	int count = burns_of(STROBE, 0, strobe, BURNS_MAX);

	for (int k = 0; k < count; k++) {
		int64_t cut_ns = guard_cuts_at(strobe[k].on_ns);

		if (strobe[k].off_ns > cut_ns)
			strobe[k].off_ns = cut_ns;
	}
	return count;
}

/* A process that is killed at any moment: lines are dark within a period. */
static void check_watched(int64_t period_ns)
{
	uint32_t told = 0;

	for (uint32_t i = 0; i < chip->change_count; i++) {
		int64_t at_ns = chip->changes[i].time_ns;

		while (told + 1 < fake_guard.told_count && fake_guard.told[told + 1].at_ns <= at_ns)
			told++;
		if (chip->changes[i].levels)
			assert_in_range(fake_guard.told[told].until_ns, at_ns,
					at_ns + period_ns + period_ns / PULSE_LATE_SHARE);
	}
}

static void every_line_follows_the_plan_to_the_nanosecond(void **state)
{
	const int shots = 401;
	int64_t armed_ns;

	(void)state;
	arm(LINES, &plan);
	armed_ns = clock_now_ns();
	for (int k = 0; k < shots; k++) {
		struct edge edge = take();

		assert_int_equal(edge.shot, k);
		assert_int_equal(edge.edge_ns, armed_ns + (k + 1) * PERIOD_NS);
		assert_int_equal(edge.missed, 0);
		assert_int_equal(edge.events, 0);
		assert_int_equal(edge.late_ns, 0);
	}
	int ir_count = burns_of(IR, 0, ir, BURNS_MAX), hd_count = burns_of(HD, 0, hd, BURNS_MAX);
	assert_in_range(ir_count, shots - 1, shots);
	assert_int_equal(burns_of(STROBE, 0, strobe, BURNS_MAX), shots);
	assert_int_equal(hd_count, (shots + 2) / 4);
	for (int k = 0; k < ir_count; k++) {
		int64_t edge_ns = armed_ns + (k + 1) * PERIOD_NS;

		assert_int_equal(ir[k].on_ns, edge_ns + plan.ir_delay_ns);
		assert_int_equal(ir[k].off_ns, ir[k].on_ns + plan.ir_exposure_ns);
		assert_int_equal(strobe[k].on_ns, edge_ns + plan.strobe_delay_ns);
		assert_int_equal(strobe[k].off_ns, strobe[k].on_ns + plan.strobe_width_ns);
	}
	for (int k = 0; k < hd_count; k++) {
		int64_t edge_ns = armed_ns + (4 * k + plan.hd_phase + 1) * PERIOD_NS;

		assert_int_equal(hd[k].on_ns, edge_ns + plan.hd_delay_ns);
		assert_int_equal(hd[k].off_ns, hd[k].on_ns + plan.hd_exposure_ns);
	}
	check_watched(PERIOD_NS);
}

static void lines_that_are_active_low_rest_high(void **state)
{
	(void)state;
	assert_int_equal(open_lines("gpiochip0,ir=!IR_TRIG,strobe=!STROBE,hd=HD_TRIG"), 0);
	assert_int_equal(chip->levels, IR | STROBE);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &plan, &diag), 0);
	atomic_store(&chip->change_count, 0);
	run_on(9);
	assert_int_equal(burns_of(STROBE, IR | STROBE, strobe, BURNS_MAX), 9);
	assert_int_equal(strobe[8].off_ns - strobe[8].on_ns, plan.strobe_width_ns);
	gpio_trigger_driver.disarm(trigger);
	assert_int_equal(chip->levels, IR | STROBE);
}

static void all_is_dark_after_disarm_whatever_was_lit(void **state)
{
	struct edge edge;

	(void)state;
	arm(LINES, &plan);
	for (int64_t into_ns = 0; into_ns < 5 * NS_PER_MS; into_ns += 130 * NS_PER_US) {
		run_on(1);
		gpio_trigger_driver.next(trigger, PERIOD_NS / 2 + into_ns, &edge);
		gpio_trigger_driver.disarm(trigger);
		assert_int_equal(chip->levels, 0);
		assert_int_equal(next(&edge), -ENODEV);
		assert_int_equal(gpio_trigger_driver.arm(trigger, &plan, &diag), 0);
		assert_int_equal(take().shot, 0);
	}
}

/* What one burn may last at the worst. */
static int64_t burn_max_ns(const struct trigger_plan *with)
{
	return (int64_t)(with->strobe_duty_max * (double)with->period_ns) + 100 * NS_PER_US;
}

/* Its share of any stretch of time is kept, but for one burn. */
static void check_duty(int count, const struct trigger_plan *with)
{
	for (int a = 0; a < count; a++) {
		double burnt_ns = 0;

		for (int b = a; b < count && b < a + 60; b++) {
			double passed_ns = (double)(strobe[b].off_ns - strobe[a].on_ns);

			burnt_ns += (double)(strobe[b].off_ns - strobe[b].on_ns);
			assert_true(burnt_ns <=
				    with->strobe_duty_max * passed_ns + (double)burn_max_ns(with));
		}
	}
}

/* Numbers say when: every shot is fired in its own period, a little late at most, and what was
 * missed is told. */
static void check_numbers(const struct edge *edges, int count, int64_t armed_ns,
			  const struct trigger_plan *with)
{
	int64_t late_max_ns = with->period_ns / PULSE_LATE_SHARE;
	int ir_count = burns_of(IR, 0, ir, BURNS_MAX);
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
	arm(LINES, with);
	armed_ns = clock_now_ns();
	for (int k = 0; k < 600; k++) {
		if (rng_uniform(&rng) < 0.1)
			clock_sleep_until(clock_now_ns() +
					  (int64_t)(rng_uniform(&rng) * 3 * (double)PERIOD_NS));
		if (rng_uniform(&rng) < 0.1) {
			chip->slow_after_ns = (int64_t)(rng_uniform(&rng) * 2e6);
			atomic_store(&chip->slow_change,
				     chip->change_count + 1 + rng_u32(&rng) % 6);
		}
		edges[k] = take();
		total += edges[k].missed;
	}
	check_numbers(edges, 600, armed_ns, with);
	assert_true(total > 10);
	int count = guarded_burns();
	for (int k = 0; k < count; k++)
		assert_true(strobe[k].off_ns - strobe[k].on_ns <= burn_max_ns(with));
	check_duty(count, with);
	gpio_trigger_driver.close(trigger);
	trigger = NULL;
	atomic_store(&chip->slow_change, 0);
}

static void stalls_shorten_and_skip_and_name_but_never_burn_longer(void **state)
{
	struct trigger_plan at_the_limit = plan, always_open = plan;

	(void)state;
	always_open.ir_exposure_ns = PERIOD_NS - always_open.ir_delay_ns;
	at_the_limit.strobe_width_ns = 400 * NS_PER_US;
	at_the_limit.strobe_delay_ns = at_the_limit.ir_delay_ns;
	at_the_limit.strobe_duty_max = 0.05;
	for (uint64_t seed = 1; seed <= 10; seed++) {
		live_through_stalls(seed, &plan);
		live_through_stalls(seed, &at_the_limit);
		live_through_stalls(seed, &always_open);
	}
}

static void a_strobe_at_its_limit_keeps_burning(void **state)
{
	struct trigger_plan at_the_limit = plan;

	(void)state;
	at_the_limit.strobe_duty_max = 250e3 / PERIOD_NS;
	arm(LINES, &at_the_limit);
	for (int k = 0; k < 300; k++)
		assert_int_equal(take().events, 0);
	assert_int_equal(burns_of(STROBE, 0, strobe, BURNS_MAX), 300);
}

static void a_strobe_that_is_lit_late_goes_out_in_time(void **state)
{
	struct edge edge;

	(void)state;
	arm("gpiochip0,ir=IR_TRIG,strobe=STROBE", &plan);
	run_on(3);
	chip->slow_after_ns = 150 * NS_PER_US; /* of the IR line: 100 us into the strobe's time */
	atomic_store(&chip->slow_change, chip->change_count + 2);
	edge = take();
	assert_int_equal(edge.events, 1U << PULSE_STROBE_SHORT);
	int count = burns_of(STROBE, 0, strobe, BURNS_MAX);
	int64_t burnt_ns = strobe[count - 1].off_ns - strobe[count - 1].on_ns;
	assert_in_range(burnt_ns, 140 * NS_PER_US, 230 * NS_PER_US);
	/* its middle is told as it was */
	int64_t middle_ns = strobe[count - 1].on_ns + burnt_ns / 2;
	int64_t told_ns = edge.edge_ns + plan.strobe_delay_ns + plan.strobe_width_ns / 2;
	assert_true(llabs(middle_ns - told_ns) <= edge.uncertainty_ns);
}

static void a_strobe_that_would_be_too_short_stays_dark(void **state)
{
	(void)state;
	arm("gpiochip0,ir=IR_TRIG,strobe=STROBE", &plan);
	run_on(3);
	chip->slow_after_ns = 400 * NS_PER_US;
	atomic_store(&chip->slow_change, chip->change_count + 2);
	assert_int_equal(take().events, 1U << PULSE_STROBE_SKIPPED);
	assert_int_equal(burns_of(STROBE, 0, strobe, BURNS_MAX), 3);
	assert_int_equal(take().events, 0);
}

static void periods_that_were_slept_through_are_named(void **state)
{
	struct edge edge;

	(void)state;
	arm(LINES, &plan);
	run_on(10);
	clock_sleep_until(clock_now_ns() + 5 * PERIOD_NS);
	edge = take();
	assert_int_equal(edge.missed, 5);
	assert_int_equal(edge.shot, 15);
	assert_int_equal(take().missed, 0);
}

static void what_the_guard_did_is_told(void **state)
{
	(void)state;
	arm(LINES, &plan);
	run_on(2);
	fake_guard.cut_count++;
	assert_int_equal(take().events, 1U << PULSE_GUARD_CUT);
	assert_int_equal(take().events, 0);
}

static void without_a_guard_no_strobe_burns(void **state)
{
	struct edge edge;

	(void)state;
	arm(LINES, &plan);
	run_on(2);
	fake_guard.dead = true;
	assert_int_equal(next(&edge), -EOWNERDEAD);
	assert_int_equal(burns_of(STROBE, 0, strobe, BURNS_MAX), 2);
	gpio_trigger_driver.disarm(trigger);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &plan, &diag), 0);
	assert_int_equal(fake_guard.starts, 2);
	run_on(2);
}

static void a_chip_that_goes_away_is_told(void **state)
{
	struct edge edge;

	(void)state;
	arm(LINES, &plan);
	run_on(2);
	atomic_store(&chip->gone, 1);
	assert_int_equal(next(&edge), -ENODEV);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &plan, &diag), -ENODEV);
	assert_non_null(strstr(diag.text, "gpio:gpiochip0: the chip does not answer"));
}

static void add_input_edge(int64_t time_ns)
{
	chip->edges_ns[chip->edge_count % FAKE_GPIO_EDGES] = time_ns;
	atomic_fetch_add(&chip->edge_count, 1);
}

static void the_input_tells_when_a_camera_exposed(void **state)
{
	const int64_t delay_ns = 33 * NS_PER_US;
	struct trigger_plan dark = plan;
	struct edge edge;

	(void)state;
	dark.strobe_width_ns = 0;
	arm(LINES ",exposure=EXPOSURE", &dark);
	int64_t armed_ns = clock_now_ns();
	for (int k = 0; k < 100; k++) {
		int64_t pulse_ns = armed_ns + (k + 1) * PERIOD_NS + dark.ir_delay_ns;
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
		edge = take();
		assert_int_equal(edge.shot, k);
		assert_int_equal(edge.events, expected);
		assert_int_equal(edge.edge_ns - (pulse_ns - dark.ir_delay_ns),
				 k == 60 ? 0 : delay_ns + off_ns);
	}
}

static void an_exposure_that_is_told_too_late_is_nobodys(void **state)
{
	(void)state;
	arm(LINES ",exposure=EXPOSURE", &plan);
	int64_t armed_ns = clock_now_ns();

	add_input_edge(armed_ns + PERIOD_NS + 5 * NS_PER_MS); /* 5 ms behind the pulse */
	assert_int_equal(take().events, 1U << PULSE_INPUT_MISSING);
	add_input_edge(armed_ns + 2 * PERIOD_NS + plan.ir_delay_ns + 10000);
	assert_int_equal(take().events, 1U << PULSE_INPUT_DOUBLED);
}

static void a_genlock_paces_the_shots_and_its_faults_are_named(void **state)
{
	struct edge edge;

	(void)state;
	arm(LINES ",genlock=SYNC_IN", &plan);
	int64_t at_ns = clock_now_ns() + NS_PER_S;
	uint64_t shot = 0;

	for (int k = 0; k < 100; k++, shot++) {
		uint32_t expected = 0, missed = 0;

		at_ns += PERIOD_NS + (k % 3 - 1) * 10 * NS_PER_US; /* a pace of its own */
		if (k == 40) { /* three pulses were lost on the way */
			at_ns += 3 * PERIOD_NS;
			missed = 3;
		}
		if (k == 60) {
			at_ns += PERIOD_NS / 8;
			expected = 1U << PULSE_INPUT_JITTER;
		}
		add_input_edge(at_ns);
		if (k == 70)
			add_input_edge(at_ns + NS_PER_MS); /* bounced */
		if (k == 71)
			expected = 1U << PULSE_INPUT_DOUBLED;
		edge = take();
		shot += missed;
		assert_int_equal(edge.missed, missed);
		assert_int_equal(edge.shot, shot);
		assert_int_equal(edge.events, expected);
		assert_true(llabs(edge.edge_ns - at_ns) <= edge.uncertainty_ns + 110 * NS_PER_US);
	}
	assert_int_equal(burns_of(STROBE, 0, strobe, BURNS_MAX), 100);
	assert_int_equal(gpio_trigger_driver.next(trigger, 50 * NS_PER_MS, &edge), -ETIMEDOUT);
}

static void a_genlock_that_runs_too_fast_does_not_overheat_the_strobe(void **state)
{
	struct trigger_plan at_the_limit = plan;

	(void)state;
	at_the_limit.strobe_duty_max = 250e3 / PERIOD_NS;
	arm(LINES ",genlock=SYNC_IN", &at_the_limit);
	int64_t at_ns = clock_now_ns();
	for (int k = 0; k < 200; k++) {
		at_ns += PERIOD_NS * 5 / 8;
		add_input_edge(at_ns);
		take();
	}
	int count = burns_of(STROBE, 0, strobe, BURNS_MAX);
	assert_in_range(count, 50, 200);
	check_duty(count, &at_the_limit);
}

static void a_plan_that_would_overheat_is_refused(void **state)
{
	struct trigger_plan hot = plan;

	(void)state;
	hot.strobe_duty_max = 0.01;
	assert_int_equal(open_lines(LINES), 0);
	assert_int_equal(gpio_trigger_driver.arm(trigger, &hot, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "overheats"));
	assert_int_equal(chip->levels, 0);
}

static void addresses_that_cannot_be_are_refused_with_a_reason(void **state)
{
	static const struct {
		const char *rest, *said;
		int err;
	} cases[] = {
		{"", "no chip named", -EINVAL},
		{"ir=IR_TRIG", "no chip named", -EINVAL},
		{"gpiochip0", "no line to fire", -EINVAL},
		{"gpiochip0,exposure=EXPOSURE", "no line to fire", -EINVAL},
		{"gpiochip0,ir", "'ir' does not name a line", -EINVAL},
		{"gpiochip0,ir=!", "'ir=!' does not name a line", -EINVAL},
		{"gpiochip0,,ir=IR_TRIG", "empty", -EINVAL},
		{"gpiochip0,laser=IR_TRIG", "'laser' is none of ir, strobe", -EINVAL},
		{"gpiochip0,ir=IR_TRIG,ir=STROBE", "already IR_TRIG", -EINVAL},
		{"gpiochip0,exposure=EXPOSURE,genlock=SYNC_IN", "already EXPOSURE", -EINVAL},
		{"gpiochip0,ir=IR_TRIG,strobe=!IR_TRIG", "cannot be two things", -EINVAL},
		{"gpiochip0,ir=IR_TRIGGER", "the chip's lines are IR_TRIG, STROBE, HD_TRIG",
		 -ENOENT},
		{"gpiochip0,ir=6", "no line 6", -ENOENT},
		{"gpiochip7,ir=IR_TRIG",
		 "no GPIO chip gpiochip7; there are gpiochip0 "
		 "(fake-gpiochip0)",
		 -ENODEV},
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		assert_int_equal(open_lines(cases[i].rest), cases[i].err);
		assert_null(trigger);
		assert_int_equal(diag.count, 1);
		if (!strstr(diag.text, cases[i].said))
			fail_msg("%s: %s", cases[i].rest, diag.text);
		diag_finish(&diag);
	}
	assert_int_equal(chip->change_count, 0);
}

static void chips_go_by_label_and_lines_by_number_too(void **state)
{
	char path[64];

	(void)state;
	snprintf(path, sizeof(path), "%s/gpiochip0,ir=0", dir);
	assert_int_equal(open_lines("fake-gpiochip0,ir=5"), 0);
	gpio_trigger_driver.close(trigger);
	assert_int_equal(open_lines(path), 0);
}

static void a_busy_line_is_told_with_its_user(void **state)
{
	(void)state;
	strcpy(chip->lines[1].user, "led-driver");
	assert_int_equal(open_lines(LINES), -EBUSY);
	assert_non_null(strstr(diag.text, "line STROBE is used by led-driver"));
	chip->lines[1].user[0] = 0;
	diag_finish(&diag);
	arm(LINES, &plan);
	struct trigger *second = NULL;
	assert_int_equal(gpio_trigger_driver.open(&second, LINES, &diag), -EBUSY);
	assert_non_null(strstr(diag.text, "line IR_TRIG is used by stage trigger"));
}

static void a_machine_without_chips_says_so(void **state)
{
	(void)state;
	setenv(FAKE_GPIO_DIR_ENV, "/nonexistent", 1);
	assert_int_equal(open_lines(LINES), -ENODEV);
	setenv(FAKE_GPIO_DIR_ENV, dir, 1);
	assert_true(strstr(diag.text, "this kernel has no GPIO") ||
		    strstr(diag.text, "and no other; load its driver"));
}

int main(void)
{
#define FACT(name) cmocka_unit_test_setup_teardown(name, begin, end)
	const struct CMUnitTest tests[] = {
		FACT(every_line_follows_the_plan_to_the_nanosecond),
		FACT(lines_that_are_active_low_rest_high),
		FACT(all_is_dark_after_disarm_whatever_was_lit),
		FACT(stalls_shorten_and_skip_and_name_but_never_burn_longer),
		FACT(a_strobe_at_its_limit_keeps_burning),
		FACT(a_strobe_that_is_lit_late_goes_out_in_time),
		FACT(a_strobe_that_would_be_too_short_stays_dark),
		FACT(periods_that_were_slept_through_are_named),
		FACT(what_the_guard_did_is_told),
		FACT(without_a_guard_no_strobe_burns),
		FACT(a_chip_that_goes_away_is_told),
		FACT(the_input_tells_when_a_camera_exposed),
		FACT(an_exposure_that_is_told_too_late_is_nobodys),
		FACT(a_genlock_paces_the_shots_and_its_faults_are_named),
		FACT(a_genlock_that_runs_too_fast_does_not_overheat_the_strobe),
		FACT(a_plan_that_would_overheat_is_refused),
		FACT(addresses_that_cannot_be_are_refused_with_a_reason),
		FACT(chips_go_by_label_and_lines_by_number_too),
		FACT(a_busy_line_is_told_with_its_user),
		FACT(a_machine_without_chips_says_so),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	if (!mkdtemp(dir))
		return 1;
	setenv(FAKE_GPIO_DIR_ENV, dir, 1);
	int failed = cmocka_run_group_tests(tests, NULL, NULL);
	char path[64];
	snprintf(path, sizeof(path), "%s/gpiochip0", dir);
	unlink(path);
	rmdir(dir);
	return failed;
}
