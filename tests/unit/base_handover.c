/*
 * A value that is replaced under a thread that uses it: what the thread may still read is never
 * destroyed.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>

#include "base/handover.h"

#define ROUNDS 2000

struct value {
	_Atomic int alive; /* what the user reads: its own number, 0 once destroyed */
};

static struct handover handover;
static struct value values[ROUNDS + 1];
static _Atomic bool stopping;

static void an_offer_waits_until_it_is_taken(void **state)
{
	int first = 1, second = 2, third = 3;

	(void)state;
	handover_init(&handover, &first);
	assert_true(handover_settled(&handover));
	assert_true(handover_offer(&handover, &second));
	assert_false(handover_settled(&handover));
	assert_false(handover_offer(&handover, &third));
	assert_ptr_equal(handover_take(&handover), &second);
	assert_true(handover_settled(&handover));
	assert_ptr_equal(handover_take(&handover), &second);
}

static void *use_values(void *argument)
{
	int *dead_seen = argument, newest = 0;

	while (!atomic_load(&stopping)) {
		const struct value *value = handover_take(&handover);

		for (int look = 0; look < 20; look++) {
			int number = atomic_load(&((struct value *)(uintptr_t)value)->alive);

			*dead_seen += number == 0 || number < newest;
			newest = number;
		}
		sched_yield(); /* on a busy machine the other waits for this one's time to end */
	}
	return NULL;
}

static void nothing_in_use_is_destroyed(void **state)
{
	pthread_t thread;
	int dead_seen = 0;

	(void)state;
	values[0].alive = 1;
	handover_init(&handover, &values[0]);
	assert_int_equal(pthread_create(&thread, NULL, use_values, &dead_seen), 0);
	for (int i = 1; i <= ROUNDS; i++) {
		values[i].alive = i + 1;
		assert_true(handover_offer(&handover, &values[i]));
		while (!handover_settled(&handover))
			sched_yield();
		atomic_store(&values[i - 1].alive, 0);
	}
	atomic_store(&stopping, true);
	pthread_join(thread, NULL);
	assert_int_equal(dead_seen, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_offer_waits_until_it_is_taken),
		cmocka_unit_test(nothing_in_use_is_destroyed),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
