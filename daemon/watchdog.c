/*
 * Every look goes over all threads that the station may run.
 */
#include "daemon/watchdog.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <systemd/sd-daemon.h>

#include "base/log.h"

#define FIRST_CAMERA 2 /* behind trigger and solver */
#define THREAD_MAX (FIRST_CAMERA + CAMERA_MAX)
#define LOOKS_PER_INTERVAL 4

static_assert(THREAD_MAX <= STREAM_STALL_MAX, "each may stand still");

static uint32_t list_threads(struct station *station, struct realtime_thread *threads[THREAD_MAX])
{
	uint32_t count = 0;

	threads[count++] = &station->pulses.thread;
	threads[count++] = &station->solver.thread;
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		threads[count++] = &station->captures[c].thread;
	return count;
}

static void watch_one(struct realtime_thread *thread, const struct log_fields *about,
		      int64_t still_ns)
{
	bool stalled = still_ns > HEARTBEAT_LATE_NS;

	if (stalled && !thread->stall_told)
		log_about(LOG_LEVEL_ERROR, about,
			  "%s: no heartbeat for %.1f s: its thread hangs, in a driver or without a "
			  "processor to run on",
			  thread->name, (double)still_ns / NS_PER_S);
	else if (!stalled && thread->stall_told && thread->heartbeat.expected)
		log_about(LOG_LEVEL_INFO, about, "%s: its heart beats again", thread->name);
	thread->stall_told = stalled;
}

void watch_heartbeats(struct station *station)
{
	struct realtime_thread *threads[THREAD_MAX];
	uint32_t count = list_threads(station, threads);
	int64_t now_ns = clock_now_ns();

	for (uint32_t i = 0; i < count; i++) {
		struct log_fields about = {
			.camera = i >= FIRST_CAMERA ? threads[i]->name : NULL,
			.shot = station->newest_shot,
		};

		watch_one(threads[i], &about, heartbeat_still_ns(&threads[i]->heartbeat, now_ns));
	}
}

uint32_t find_stalls(struct station *station, int64_t now_ns,
		     struct stream_stall stalls[STREAM_STALL_MAX])
{
	struct realtime_thread *threads[THREAD_MAX];
	uint32_t count = list_threads(station, threads), stall_count = 0;

	for (uint32_t i = 0; i < count; i++) {
		int64_t still_ns = heartbeat_still_ns(&threads[i]->heartbeat, now_ns);

		if (still_ns > HEARTBEAT_LATE_NS)
			stalls[stall_count++] = (struct stream_stall){threads[i]->name, still_ns};
	}
	return stall_count;
}

static void kick_if_all_moved(struct station *station)
{
	struct realtime_thread *threads[THREAD_MAX];
	uint32_t count = list_threads(station, threads);

	for (uint32_t i = 0; i < count; i++)
		if (!heartbeat_moved(&threads[i]->heartbeat))
			return;
	for (uint32_t i = 0; i < count; i++)
		heartbeat_kicked(&threads[i]->heartbeat);
	sd_notify(0, "WATCHDOG=1");
}

static int on_timer(sd_event_source *source, uint64_t time_us, void *user)
{
	struct watchdog *watchdog = user;

	kick_if_all_moved(watchdog->station);
	sd_event_source_set_time(source, time_us + watchdog->interval_us);
	return sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
}

int watchdog_start(struct watchdog *watchdog, sd_event *event, struct station *station)
{
	uint64_t timeout_us, now_us = (uint64_t)(clock_real_now_ns() / NS_PER_US);

	if (sd_watchdog_enabled(0, &timeout_us) <= 0)
		return 0;
	*watchdog = (struct watchdog){.station = station,
				      .interval_us = timeout_us / LOOKS_PER_INTERVAL};
	int err = sd_event_add_time(event, &watchdog->timer, CLOCK_MONOTONIC,
				    now_us + watchdog->interval_us, 10000, on_timer, watchdog);
	return err < 0 ? err : 0;
}

void watchdog_stop(struct watchdog *watchdog)
{
	sd_event_source_disable_unref(watchdog->timer);
	watchdog->timer = NULL;
}
