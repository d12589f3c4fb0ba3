/*
 * The clock map against made-up device clocks whose truth is known: offset, drift, jitter, steps.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include <math.h>

#include "base/clock.h"
#include "base/rng.h"
#include "drivers/clock_map.h"

#define PERIOD_NS INT64_C(16666667)
#define YEAR_NS (INT64_C(31557600) * NS_PER_S)
#define PATH_NS INT64_C(80000)
#define MEAN_JITTER_NS 200000.0

/* A device clock: host = start + offset + (1 + drift) * elapsed. */
struct device {
	int64_t start_ns;
	int64_t offset_ns;
	double drift;
	struct rng rng;
};

static int64_t device_ns(const struct device *d, int64_t n)
{
	return d->start_ns + n * PERIOD_NS;
}

static int64_t true_host_ns(const struct device *d, int64_t n)
{
	return device_ns(d, n) + d->offset_ns + llround(d->drift * (double)(n * PERIOD_NS));
}

/* Message n: the path, and a queue in front of it that is often short and sometimes long. */
static void send_message(struct clock_map *map, struct device *d, int64_t n)
{
	int64_t jitter_ns = llround(-MEAN_JITTER_NS * log(1.0 - rng_uniform(&d->rng)));

	clock_map_sample(map, device_ns(d, n), true_host_ns(d, n) + PATH_NS + jitter_ns);
}

/* The largest error over messages [from, to), and that it never exceeds the bound given with it. */
static int64_t largest_error_ns(struct clock_map *map, struct device *d, int64_t from, int64_t to)
{
	int64_t largest_ns = 0;

	for (int64_t n = from; n < to; n++) {
		int64_t uncertainty_ns;

		send_message(map, d, n);
		int64_t host_ns = clock_map_host_ns(map, device_ns(d, n), &uncertainty_ns);
		int64_t error_ns = llabs(host_ns - true_host_ns(d, n));

		assert_true(error_ns <= uncertainty_ns);
		largest_ns = error_ns > largest_ns ? error_ns : largest_ns;
	}
	return largest_ns;
}

static struct device make_device(int64_t start_ns, int64_t offset_ns, double drift)
{
	struct device d = {.start_ns = start_ns, .offset_ns = offset_ns, .drift = drift};

	rng_init(&d.rng, 7, 1);
	return d;
}

static void jitter_is_filtered_to_the_fastest_path(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(NS_PER_S, 0, 0.0);

	(void)state;
	largest_error_ns(&map, &d, 0, 300);
	assert_in_range(largest_error_ns(&map, &d, 300, 3000), PATH_NS / 2, PATH_NS + 30000);
}

static void drift_of_50_ppm_is_followed_either_way(void **state)
{
	(void)state;
	for (int sign = -1; sign <= 1; sign += 2) {
		struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
		struct device d = make_device(NS_PER_S, 0, sign * 50e-6);

		largest_error_ns(&map, &d, 0, 600);
		assert_true(largest_error_ns(&map, &d, 600, 6000) < PATH_NS + 40000);
		assert_true(fabs(map.drift - sign * 50e-6) < 5e-6);
	}
}

static void offset_of_years_costs_no_precision(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(56 * YEAR_NS, -55 * YEAR_NS, 20e-6);

	(void)state;
	largest_error_ns(&map, &d, 0, 600);
	assert_true(largest_error_ns(&map, &d, 600, 3000) < PATH_NS + 40000);
}

static void first_answer_is_within_its_bound(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
		struct device d = make_device(NS_PER_S, YEAR_NS, 100e-6);

		rng_init(&d.rng, seed, 2);
		largest_error_ns(&map, &d, 0, 4);
	}
}

static void answers_rise_while_the_map_learns(void **state)
{
	struct clock_map map = {.path_bound_ns = PATH_NS};
	struct device d = make_device(NS_PER_S, 0, -80e-6);
	int64_t last_ns = 0, uncertainty_ns;

	(void)state;
	for (int64_t n = 0; n < 2000; n++) {
		send_message(&map, &d, n);
		for (int64_t step = 0; step < 4; step++) {
			int64_t host_ns = clock_map_host_ns(&map, device_ns(&d, n) + step * 1000,
							    &uncertainty_ns);

			assert_true(host_ns > last_ns);
			last_ns = host_ns;
		}
	}
}

static void step_forward_is_taken_at_once(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(NS_PER_S, 0, 0.0);

	(void)state;
	largest_error_ns(&map, &d, 0, 600);
	d.start_ns += 3600 * NS_PER_S;
	d.offset_ns -= 3600 * NS_PER_S;
	assert_true(largest_error_ns(&map, &d, 600, 601) < NS_PER_MS);
	assert_int_equal(map.resets, 1);
}

static void restarted_device_clock_is_taken_at_once(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(3600 * NS_PER_S, 0, 0.0);

	(void)state;
	largest_error_ns(&map, &d, 0, 600);
	d.start_ns -= 3600 * NS_PER_S;
	d.offset_ns += 3600 * NS_PER_S;
	assert_true(largest_error_ns(&map, &d, 600, 601) < NS_PER_MS);
}

static void small_step_back_is_taken_within_three_seconds(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(NS_PER_S, 0, 0.0);

	(void)state;
	largest_error_ns(&map, &d, 0, 600);
	d.start_ns -= 100 * NS_PER_MS;
	d.offset_ns += 100 * NS_PER_MS;
	for (int64_t n = 600; n < 780; n++)
		send_message(&map, &d, n);
	assert_true(largest_error_ns(&map, &d, 780, 1000) < PATH_NS + 200000);
}

static void stall_of_the_host_does_not_move_the_map(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(NS_PER_S, 0, 0.0);
	int64_t uncertainty_ns;

	(void)state;
	largest_error_ns(&map, &d, 0, 600);
	for (int64_t n = 600; n < 660; n++)
		clock_map_sample(&map, device_ns(&d, n), true_host_ns(&d, 660));
	int64_t host_ns = clock_map_host_ns(&map, device_ns(&d, 660), &uncertainty_ns);

	assert_true(llabs(host_ns - true_host_ns(&d, 660)) < PATH_NS + 40000);
	assert_int_equal(map.resets, 0);
}

/* A new bin begins with a message of the stall, for every length of time that the map is old. */
static void bound_stays_true_and_tight_right_behind_a_stall(void **state)
{
	(void)state;
	for (int64_t stalled = 270; stalled < 900; stalled += 5) {
		struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
		struct device d = make_device(NS_PER_S, 0, 20e-6);

		clock_map_anchor(&map, device_ns(&d, 0), true_host_ns(&d, 0) + 30000, 40000);
		largest_error_ns(&map, &d, 0, stalled);
		for (int64_t n = stalled; n < stalled + 18; n++) {
			int64_t uncertainty_ns;

			clock_map_sample(&map, device_ns(&d, n), true_host_ns(&d, stalled + 18));
			int64_t host_ns =
				clock_map_host_ns(&map, device_ns(&d, n), &uncertainty_ns);
			assert_true(llabs(host_ns - true_host_ns(&d, n)) <= uncertainty_ns);
			assert_true(uncertainty_ns < NS_PER_MS);
		}
		largest_error_ns(&map, &d, stalled + 18, stalled + 1200);
	}
}

/* Messages that travel long, as on a busy machine; the reading is off by 40 us at most. */
static void two_sided_reading_bounds_every_answer(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
		struct device d = make_device(NS_PER_S, YEAR_NS, seed % 2 ? 80e-6 : -80e-6);

		rng_init(&d.rng, seed, 3);
		clock_map_anchor(&map, device_ns(&d, 0), true_host_ns(&d, 0) + 30000, 40000);
		for (int64_t n = 2; n < 1500; n++) {
			int64_t jitter_ns = 3 * NS_PER_MS + (int64_t)(rng_u32(&d.rng) % 400000);
			int64_t uncertainty_ns;

			clock_map_sample(&map, device_ns(&d, n), true_host_ns(&d, n) + jitter_ns);
			int64_t host_ns =
				clock_map_host_ns(&map, device_ns(&d, n), &uncertainty_ns);

			assert_true(llabs(host_ns - true_host_ns(&d, n)) <= uncertainty_ns);
			assert_true(n < 600 || uncertainty_ns < 300000);
		}
	}
}

static void reading_of_another_clock_is_ignored(void **state)
{
	struct clock_map map = {.path_bound_ns = 2 * PATH_NS};
	struct device d = make_device(NS_PER_S, 0, 0.0);

	(void)state;
	clock_map_anchor(&map, YEAR_NS, true_host_ns(&d, 0), 40000);
	assert_true(largest_error_ns(&map, &d, 0, 300) < NS_PER_MS);
	assert_false(map.anchored);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(jitter_is_filtered_to_the_fastest_path),
		cmocka_unit_test(drift_of_50_ppm_is_followed_either_way),
		cmocka_unit_test(offset_of_years_costs_no_precision),
		cmocka_unit_test(first_answer_is_within_its_bound),
		cmocka_unit_test(answers_rise_while_the_map_learns),
		cmocka_unit_test(step_forward_is_taken_at_once),
		cmocka_unit_test(restarted_device_clock_is_taken_at_once),
		cmocka_unit_test(small_step_back_is_taken_within_three_seconds),
		cmocka_unit_test(stall_of_the_host_does_not_move_the_map),
		cmocka_unit_test(bound_stays_true_and_tight_right_behind_a_stall),
		cmocka_unit_test(two_sided_reading_bounds_every_answer),
		cmocka_unit_test(reading_of_another_clock_is_ignored),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
