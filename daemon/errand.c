/*
 * A thread an errand.
 */
#include "daemon/errand.h"

#include "base/clock_virtual.h"

#define PATIENCE_NS (500 * NS_PER_MS)

static void *thread(void *argument)
{
	struct errand *errand = argument;

	errand->run(errand->user);
	atomic_store(&errand->done, true);
	clock_release();
	return NULL;
}

bool errand_begin(struct errand *errand, void (*run)(void *user), void *user)
{
	if (errand->busy)
		return false;
	errand->run = run;
	errand->user = user;
	atomic_store(&errand->done, false);
	clock_hold();
	errand->busy = pthread_create(&errand->thread, NULL, thread, errand) == 0;
	if (!errand->busy)
		clock_release();
	return errand->busy;
}

bool errand_poll(struct errand *errand)
{
	if (!errand->busy || !atomic_load(&errand->done))
		return false;
	pthread_join(errand->thread, NULL);
	errand->busy = false;
	return true;
}

bool errand_finish(struct errand *errand)
{
	int64_t until_ns = clock_real_now_ns() + PATIENCE_NS;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	if (errand->busy &&
	    pthread_clockjoin_np(errand->thread, NULL, CLOCK_MONOTONIC, &until) != 0)
		return false;
	errand->busy = false;
	return true;
}
