/*
 * The frame counter over the 16-bit wrap, gaps, and 64-bit devices.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "drivers/frame_counter.h"

static void wrap_from_65535_to_1_is_one_step(void **state)
{
	struct frame_counter counter = {0};

	(void)state;
	assert_int_equal(frame_counter_extend(&counter, 65534), 65534);
	assert_int_equal(frame_counter_extend(&counter, 65535), 65535);
	assert_int_equal(frame_counter_extend(&counter, 1), 65536);
	assert_int_equal(frame_counter_extend(&counter, 2), 65537);
}

static void gap_over_the_wrap_is_the_number_lost(void **state)
{
	struct frame_counter counter = {0};

	(void)state;
	uint64_t before = frame_counter_extend(&counter, 65530);

	assert_int_equal(frame_counter_extend(&counter, 4) - before, 9);
}

static void three_turns_count_on(void **state)
{
	struct frame_counter counter = {0};
	uint64_t id = 65400, expected = 65400;

	(void)state;
	for (int i = 0; i < 200000; i++) {
		assert_int_equal(frame_counter_extend(&counter, id), expected++);
		id = id == 65535 ? 1 : id + 1;
	}
}

static void wide_ids_pass_65535_without_a_wrap(void **state)
{
	struct frame_counter counter = {0};

	(void)state;
	frame_counter_extend(&counter, 65535);
	assert_int_equal(frame_counter_extend(&counter, 65536), 65536);
	assert_int_equal(frame_counter_extend(&counter, 65539), 65539);
}

static void repeated_frame_repeats_its_number(void **state)
{
	struct frame_counter counter = {0};

	(void)state;
	frame_counter_extend(&counter, 7);
	assert_int_equal(frame_counter_extend(&counter, 7), 7);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(wrap_from_65535_to_1_is_one_step),
		cmocka_unit_test(gap_over_the_wrap_is_the_number_lost),
		cmocka_unit_test(three_turns_count_on),
		cmocka_unit_test(wide_ids_pass_65535_without_a_wrap),
		cmocka_unit_test(repeated_frame_repeats_its_number),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
