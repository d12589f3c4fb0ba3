/*
 * See stall_watch.h.
 */
#include "tests/hil/stall_watch.h"

#include <sched.h>

#include "base/clock.h"

#define STEP_NS (5 * NS_PER_MS)
#define PRIORITY 60 /* below the guard's, above all else of the station's but the trigger */

static void note(struct stall_watch *watch, int64_t begin_ns, int64_t end_ns)
{
	uint32_t i = watch->count < STALLS_MAX ? watch->count : STALLS_MAX - 1;

	if (i < watch->count) /* one more is part of the last one */
		begin_ns = watch->stalls[i].begin_ns;
	watch->stalls[i].begin_ns = begin_ns;
	watch->stalls[i].end_ns = end_ns;
	watch->count = i + 1;
}

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
		if (late_ns > STALL_NS)
			note(watch, wake_ns, wake_ns + late_ns);
	}
	return NULL;
}

int stall_watch_begin(struct stall_watch *watch)
{
	watch->ending = false;
	watch->longest_ns = 0;
	watch->count = 0;
	return -pthread_create(&watch->thread, NULL, look, watch);
}

void stall_watch_end(struct stall_watch *watch)
{
	watch->ending = true;
	pthread_join(watch->thread, NULL);
}

bool stall_watch_stood_still(const struct stall_watch *watch, int64_t from_ns, int64_t to_ns)
{
	for (uint32_t i = 0; i < watch->count; i++)
		if (watch->stalls[i].begin_ns < to_ns && watch->stalls[i].end_ns > from_ns)
			return true;
	return false;
}
