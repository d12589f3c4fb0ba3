/*
 * A camera that sends nothing is asked for its discovery acknowledge: it answers that to everybody,
 * whoever controls it, armed or idle. One that waits for a trigger thus costs a packet per look.
 */
#include "drivers/aravis/aravis_watch.h"

#include <errno.h>

#include "base/clock.h"
#include "drivers/aravis/aravis_device.h"

#define LOOK_NS (400 * NS_PER_MS)

/* False when it is over. */
static bool wait_for_look(struct aravis_watch *watch)
{
	int64_t at_ns = clock_now_ns() + LOOK_NS;
	struct timespec at = {.tv_sec = at_ns / NS_PER_S, .tv_nsec = at_ns % NS_PER_S};

	while (sem_clockwait(&watch->ending, CLOCK_MONOTONIC, &at))
		if (errno == ETIMEDOUT)
			return true;
	return false;
}

static void *look(void *user)
{
	struct aravis_watch *watch = user;
	uint32_t frames = atomic_load(watch->frames);

	pthread_setname_np(pthread_self(), "aravis-watch");
	while (wait_for_look(watch)) {
		uint32_t before = frames;

		frames = atomic_load(watch->frames);
		if (frames == before && aravis_probe(watch->ip)) {
			watch->gone(watch->user);
			return NULL;
		}
		watch->look(watch->user);
	}
	return NULL;
}

int aravis_watch_init(struct aravis_watch *watch)
{
	sem_init(&watch->ending, 0, 0);
	int error = -pthread_create(&watch->thread, NULL, look, watch);

	watch->running = !error;
	if (error)
		sem_destroy(&watch->ending);
	return error;
}

void aravis_watch_finish(struct aravis_watch *watch)
{
	if (!watch->running)
		return;
	sem_post(&watch->ending);
	pthread_join(watch->thread, NULL);
	sem_destroy(&watch->ending);
	watch->running = false;
}
