/*
 * See stall_watch.h.
 */
#include "tests/hil/stall_watch.h"

#include <sched.h>

#include "base/clock.h"

#define STEP_NS (5 * NS_PER_MS)
#define PRIORITY 60 /* below the guard's, above all else of the station's but the trigger */

static void *look(void *user)
{
	struct stall_watch *watch = user;
	struct sched_param param = {.sched_priority = PRIORITY};

	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
	while (!watch->ending) {
		int64_t wake_ns = clock_now_ns() + STEP_NS;

		clock_sleep_until(wake_ns);
		int64_t late_ns = clock_now_ns() - wake_ns;

		if (late_ns > watch->longest_ns)
			watch->longest_ns = late_ns;
	}
	return NULL;
}

int stall_watch_begin(struct stall_watch *watch)
{
	watch->ending = false;
	watch->longest_ns = 0;
	return -pthread_create(&watch->thread, NULL, look, watch);
}

int64_t stall_watch_end(struct stall_watch *watch)
{
	watch->ending = true;
	pthread_join(watch->thread, NULL);
	return watch->longest_ns;
}
