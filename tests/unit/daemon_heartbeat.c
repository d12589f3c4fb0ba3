/*
 * Heartbeats: how long they stand still, and whether they moved between two kicks.
 */
#include "daemon/heartbeat.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void one_that_nobody_moves_is_never_late(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	assert_int_equal(heartbeat_still_ns(&heartbeat, 100 * NS_PER_S), 0);
	assert_true(heartbeat_moved(&heartbeat));
}

static void one_that_moves_is_not_late(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	heartbeat_expect(&heartbeat, 0);
	for (int s = 1; s < 10; s++) {
		heartbeat_beat(&heartbeat);
		assert_int_equal(heartbeat_still_ns(&heartbeat, s * NS_PER_S), 0);
	}
}

static void one_that_stands_still_tells_since_when(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	heartbeat_expect(&heartbeat, 5 * NS_PER_S);
	assert_int_equal(heartbeat_still_ns(&heartbeat, 7 * NS_PER_S), 2 * NS_PER_S);
	heartbeat_beat(&heartbeat);
	assert_int_equal(heartbeat_still_ns(&heartbeat, 8 * NS_PER_S), 0);
	assert_int_equal(heartbeat_still_ns(&heartbeat, 11 * NS_PER_S), 3 * NS_PER_S);
}

static void a_kick_needs_a_beat_since_the_last(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	heartbeat_expect(&heartbeat, 0);
	assert_false(heartbeat_moved(&heartbeat));
	heartbeat_beat(&heartbeat);
	assert_true(heartbeat_moved(&heartbeat));
	/* looking at it does not use the beat up; a kick does */
	heartbeat_still_ns(&heartbeat, NS_PER_S);
	assert_true(heartbeat_moved(&heartbeat));
	heartbeat_kicked(&heartbeat);
	assert_false(heartbeat_moved(&heartbeat));
}

static void a_thread_that_has_ended_holds_nothing_up(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	heartbeat_expect(&heartbeat, 0);
	heartbeat_forget(&heartbeat);
	assert_true(heartbeat_moved(&heartbeat));
	assert_int_equal(heartbeat_still_ns(&heartbeat, 100 * NS_PER_S), 0);
}

static void a_thread_that_ends_by_itself_is_not_late(void **state)
{
	struct heartbeat heartbeat = {0};

	(void)state;
	heartbeat_expect(&heartbeat, 0);
	heartbeat_end(&heartbeat);
	assert_true(heartbeat_moved(&heartbeat));
	assert_int_equal(heartbeat_still_ns(&heartbeat, 100 * NS_PER_S), 0);
	heartbeat_expect(&heartbeat, 100 * NS_PER_S); /* started anew */
	assert_int_equal(heartbeat_still_ns(&heartbeat, 102 * NS_PER_S), 2 * NS_PER_S);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_that_nobody_moves_is_never_late),
		cmocka_unit_test(one_that_moves_is_not_late),
		cmocka_unit_test(one_that_stands_still_tells_since_when),
		cmocka_unit_test(a_kick_needs_a_beat_since_the_last),
		cmocka_unit_test(a_thread_that_has_ended_holds_nothing_up),
		cmocka_unit_test(a_thread_that_ends_by_itself_is_not_late),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
