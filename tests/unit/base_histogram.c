/*
 * The histogram against sorted values, and its bounds.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/histogram.h"
#include "base/rng.h"

#define VALUE_COUNT 20000

static struct histogram histogram, other;
static int64_t values_ns[VALUE_COUNT];

static int empty(void **state)
{
	(void)state;
	memset(&histogram, 0, sizeof(histogram));
	memset(&other, 0, sizeof(other));
	return 0;
}

static int compare(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

static void percentiles_are_within_a_32nd_of_the_sorted_values(void **state)
{
	static const double parts[] = {0.0, 0.001, 0.5, 0.9, 0.99, 0.999, 1.0};
	struct rng rng;

	(void)state;
	rng_init(&rng, 3, 1);
	for (int i = 0; i < VALUE_COUNT; i++) {
		values_ns[i] = (int64_t)(1e5 * __builtin_exp(2.5 * rng_normal(&rng)));
		histogram_add(&histogram, values_ns[i]);
	}
	qsort(values_ns, VALUE_COUNT, sizeof(values_ns[0]), compare);
	for (size_t p = 0; p < sizeof(parts) / sizeof(parts[0]); p++) {
		int wanted = (int)__builtin_ceil(parts[p] * VALUE_COUNT);
		int64_t true_ns = values_ns[wanted > 0 ? wanted - 1 : 0];

		assert_in_range(histogram_part_ns(&histogram, parts[p]), true_ns,
				true_ns + true_ns / 32);
	}
	assert_int_equal(histogram_part_ns(&histogram, 1), values_ns[VALUE_COUNT - 1]);
}

static void small_values_are_exact(void **state)
{
	(void)state;
	for (int64_t value = 0; value < 64; value++)
		histogram_add(&histogram, value);
	assert_int_equal(histogram_part_ns(&histogram, 0), 0);
	assert_int_equal(histogram_part_ns(&histogram, 0.5), 31);
	assert_int_equal(histogram_part_ns(&histogram, 1), 63);
}

static void every_power_of_two_and_its_neighbours_fall_into_their_bucket(void **state)
{
	(void)state;
	for (int bit = 0; bit < 40; bit++)
		for (int64_t value = (INT64_C(1) << bit) - 1; value <= (INT64_C(1) << bit) + 1;
		     value++) {
			memset(&histogram, 0, sizeof(histogram));
			histogram_add(&histogram, value);
			histogram_add(&histogram, HISTOGRAM_MAX_NS);
			assert_in_range(histogram_part_ns(&histogram, 0.5), value,
					value + value / 32);
		}
}

static void what_is_out_of_range_counts_at_the_ends(void **state)
{
	(void)state;
	histogram_add(&histogram, -5);
	histogram_add(&histogram, INT64_MIN);
	assert_int_equal(histogram_part_ns(&histogram, 1), 0);
	histogram_add(&histogram, INT64_MAX);
	assert_int_equal(histogram_part_ns(&histogram, 1), HISTOGRAM_MAX_NS);
	assert_int_equal(histogram.count, 3);
}

static void an_empty_one_has_no_percentile_but_zero(void **state)
{
	(void)state;
	assert_int_equal(histogram_part_ns(&histogram, 0.5), 0);
}

static void merged_is_as_if_added_to_one(void **state)
{
	static struct histogram both;

	(void)state;
	memset(&both, 0, sizeof(both));
	for (int64_t value = 1; value < 1000000; value = value * 7 / 5 + 1) {
		histogram_add(value % 2 ? &histogram : &other, value);
		histogram_add(&both, value);
	}
	histogram_merge(&histogram, &other);
	assert_memory_equal(&histogram, &both, sizeof(both));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(percentiles_are_within_a_32nd_of_the_sorted_values, empty),
		cmocka_unit_test_setup(small_values_are_exact, empty),
		cmocka_unit_test_setup(every_power_of_two_and_its_neighbours_fall_into_their_bucket,
				       empty),
		cmocka_unit_test_setup(what_is_out_of_range_counts_at_the_ends, empty),
		cmocka_unit_test_setup(an_empty_one_has_no_percentile_but_zero, empty),
		cmocka_unit_test_setup(merged_is_as_if_added_to_one, empty),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
