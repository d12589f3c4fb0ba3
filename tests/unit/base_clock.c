/*
 * Virtual time: it waits for whoever works, goes on in one order, and real time stays real.
 */
#include "base/clock_virtual.h"

#include <poll.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define START_NS (1000 * NS_PER_S)
#define SLEEPERS 8
#define ROUNDS 500

struct sleeper {
	pthread_t thread;
	int64_t period_ns;
	int64_t woken_ns[ROUNDS];
	uint32_t late_count;
};

static struct sleeper sleepers[SLEEPERS];
static struct clock_semaphore work;
static _Atomic int posted_count;

static int begin(void **state)
{
	(void)state;
	memset(sleepers, 0, sizeof(sleepers));
	posted_count = 0;
	clock_virtual_begin(START_NS, CLOCK_NO_LIMIT);
	clock_semaphore_init(&work);
	return 0;
}

static int end(void **state)
{
	(void)state;
	clock_semaphore_finish(&work);
	clock_virtual_end();
	return 0;
}

static void burn(uint32_t steps)
{
	for (volatile uint32_t i = 0; i < steps; i++)
		;
}

static void *sleep_in_rounds(void *argument)
{
	struct sleeper *sleeper = argument;
	int64_t due_ns = START_NS;

	clock_thread_begin();
	for (int i = 0; i < ROUNDS; i++) {
		due_ns += sleeper->period_ns;
		clock_sleep_until(due_ns);
		sleeper->woken_ns[i] = clock_now_ns();
		burn(2000); /* no time passes meanwhile */
		sleeper->late_count += clock_now_ns() != due_ns;
		posted_count++;
		clock_semaphore_post(&work);
	}
	clock_thread_end();
	return NULL;
}

static void start(struct sleeper *sleeper, int64_t period_ns, void *(*run)(void *))
{
	sleeper->period_ns = period_ns;
	clock_thread_expect();
	assert_int_equal(pthread_create(&sleeper->thread, NULL, run, sleeper), 0);
}

/* All start at the same moment. */
static void start_all(bool same_period)
{
	clock_hold();
	for (int i = 0; i < SLEEPERS; i++)
		start(&sleepers[i], (same_period ? 10 : 7 + i) * NS_PER_MS, sleep_in_rounds);
	clock_release();
}

static void join_all(void)
{
	for (int i = 0; i < SLEEPERS; i++)
		pthread_join(sleepers[i].thread, NULL);
}

static void nobody_wakes_early_or_late(void **state)
{
	int64_t real_ns = clock_real_now_ns();

	(void)state;
	start_all(false);
	join_all();
	for (int i = 0; i < SLEEPERS; i++) {
		assert_int_equal(sleepers[i].late_count, 0);
		for (int k = 0; k < ROUNDS; k++)
			assert_int_equal(sleepers[i].woken_ns[k],
					 START_NS + (k + 1) * sleepers[i].period_ns);
	}
	assert_int_equal(clock_now_ns(), START_NS + ROUNDS * 14 * NS_PER_MS);
	assert_true(clock_real_now_ns() - real_ns < 7 * NS_PER_S); /* virtually, it was 7 s */
}

static void *collect(void *argument)
{
	struct sleeper *collector = argument;

	clock_thread_begin();
	for (int i = 0; i < ROUNDS; i++) {
		clock_semaphore_wait(&work, clock_now_ns() + NS_PER_S);
		/* all of this moment have posted, and nobody has gone on to the next */
		collector->late_count += posted_count != (i + 1) * SLEEPERS;
		collector->woken_ns[i] = clock_now_ns();
	}
	clock_thread_end();
	return NULL;
}

static void one_who_waits_for_work_sees_all_of_the_moment(void **state)
{
	static struct sleeper collector;

	(void)state;
	clock_hold();
	start(&collector, 0, collect);
	start_all(true);
	clock_release();
	join_all();
	pthread_join(collector.thread, NULL);
	assert_int_equal(collector.late_count, 0);
	for (int i = 0; i < ROUNDS; i++)
		assert_int_equal(collector.woken_ns[i], START_NS + (i + 1) * 10 * NS_PER_MS);
}

static void *wait_for_work(void *argument)
{
	struct sleeper *waiter = argument;

	clock_thread_begin();
	clock_semaphore_wait(&work, START_NS + waiter->period_ns);
	waiter->woken_ns[0] = clock_now_ns();
	clock_thread_end();
	return NULL;
}

static void waiting_for_work_that_never_comes_ends_at_its_deadline(void **state)
{
	(void)state;
	start(&sleepers[0], 30 * NS_PER_MS, wait_for_work);
	pthread_join(sleepers[0].thread, NULL);
	assert_int_equal(sleepers[0].woken_ns[0], START_NS + 30 * NS_PER_MS);
}

static void time_stands_still_while_it_is_held(void **state)
{
	(void)state;
	clock_hold();
	clock_hold();
	start(&sleepers[0], 30 * NS_PER_MS, sleep_in_rounds);
	clock_release();
	usleep(20000);
	assert_int_equal(clock_now_ns(), START_NS);
	clock_release();
	pthread_join(sleepers[0].thread, NULL);
	assert_int_equal(clock_now_ns(), START_NS + ROUNDS * 30 * NS_PER_MS);
}

static void time_goes_no_further_than_its_limit(void **state)
{
	(void)state;
	clock_virtual_set_limit(START_NS + 95 * NS_PER_MS);
	start(&sleepers[0], 10 * NS_PER_MS, sleep_in_rounds);
	while (!clock_virtual_at_limit())
		usleep(100);
	assert_int_equal(clock_now_ns(), START_NS + 95 * NS_PER_MS);
	assert_int_equal(posted_count, 9);
	clock_virtual_set_limit(START_NS + 100 * NS_PER_MS);
	while (!clock_virtual_at_limit())
		usleep(100);
	assert_int_equal(posted_count, 10);
	clock_rush_begin(); /* as a station that is stopped does */
	pthread_join(sleepers[0].thread, NULL);
	clock_rush_end();
	assert_int_equal(posted_count, ROUNDS);
}

static bool is_readable(int fd)
{
	struct pollfd poll_fd = {.fd = fd, .events = POLLIN};

	return poll(&poll_fd, 1, 2000) == 1;
}

static void time_waits_until_an_alarm_is_dealt_with(void **state)
{
	struct clock_alarm alarm;

	(void)state;
	clock_hold();
	assert_int_equal(clock_alarm_open(&alarm), 0);
	clock_alarm_set(&alarm, START_NS + 25 * NS_PER_MS);
	start(&sleepers[0], 10 * NS_PER_MS, sleep_in_rounds);
	clock_release();
	for (int i = 1; i < 10; i++) {
		assert_true(is_readable(alarm.fd));
		usleep(1000);
		assert_int_equal(clock_now_ns(), START_NS + i * 25 * NS_PER_MS);
		/* at the same moment the sleeper goes first */
		assert_int_equal(posted_count, i * 25 / 10);
		clock_alarm_set(&alarm, START_NS + (i + 1) * 25 * NS_PER_MS);
	}
	clock_alarm_close(&alarm);
	pthread_join(sleepers[0].thread, NULL);
}

static void in_real_time_nothing_waits_for_anybody(void **state)
{
	struct clock_alarm alarm;
	int64_t begin_ns = clock_now_ns();

	(void)state;
	assert_false(clock_is_virtual());
	clock_hold(); /* never released */
	clock_thread_expect();
	clock_semaphore_init(&work);
	clock_semaphore_wait(&work, begin_ns + 5 * NS_PER_MS);
	assert_true(clock_now_ns() >= begin_ns + 5 * NS_PER_MS);
	clock_semaphore_post(&work);
	clock_semaphore_post(&work);
	clock_semaphore_wait(&work, begin_ns + 3600 * NS_PER_S);
	clock_semaphore_finish(&work);
	assert_int_equal(clock_alarm_open(&alarm), 0);
	clock_alarm_set(&alarm, begin_ns + 20 * NS_PER_MS);
	assert_true(is_readable(alarm.fd));
	assert_true(clock_now_ns() >= begin_ns + 20 * NS_PER_MS);
	clock_alarm_close(&alarm);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(in_real_time_nothing_waits_for_anybody),
		cmocka_unit_test_setup_teardown(nobody_wakes_early_or_late, begin, end),
		cmocka_unit_test_setup_teardown(one_who_waits_for_work_sees_all_of_the_moment,
						begin, end),
		cmocka_unit_test_setup_teardown(
			waiting_for_work_that_never_comes_ends_at_its_deadline, begin, end),
		cmocka_unit_test_setup_teardown(time_stands_still_while_it_is_held, begin, end),
		cmocka_unit_test_setup_teardown(time_goes_no_further_than_its_limit, begin, end),
		cmocka_unit_test_setup_teardown(time_waits_until_an_alarm_is_dealt_with, begin,
						end),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
