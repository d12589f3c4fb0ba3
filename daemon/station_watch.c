/*
 * What the station does about its cameras once a second: those that were lost are reopened, and
 * when every recording is over the station has ended.
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/program_drivers.h"
#include "daemon/station.h"
#include "daemon/watchdog.h"
#include "drivers/files/files.h"

#define UNNAMED_MIN_S 2.0 /* a start from nothing takes less */

static const char *const capture_state_names[] = {
	[CAPTURE_STOPPED] = "stopped",
	[CAPTURE_RUNNING] = "running",
	[CAPTURE_ENDED] = "ended",
	[CAPTURE_LOST] = "lost",
};

const char *capture_state_name(enum capture_state state)
{
	return capture_state_names[state];
}

bool station_is_realtime(const struct station *station)
{
	bool realtime = station->solver.thread.fifo_granted;

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		realtime &= station->captures[c].thread.fifo_granted;
	return realtime;
}

static struct log_fields about(const struct station *station, const struct capture *capture)
{
	return (struct log_fields){.camera = capture->name, .shot = station->newest_shot};
}

static bool same_images(const struct camera_mode *a, const struct camera_mode *b)
{
	return a->width_px == b->width_px && a->height_px == b->height_px && a->format == b->format;
}

static int start_again(struct station *station, uint32_t index, struct diag *diag)
{
	struct camera_mode wanted = station_wanted(station, index);

	int err = capture_set_light(&station->captures[index], &wanted, diag);

	return err ? err : capture_start(&station->captures[index], diag);
}

static void take_back(struct station *station)
{
	struct reopener *reopener = &station->reopener;
	struct capture *capture = &station->captures[reopener->camera];
	struct camera_mode before = capture->device.granted;
	struct log_fields camera = about(station, capture);
	struct diag diag = {0};

	if (reopener->error) {
		if (reopener->diag.text)
			capture_lose(capture, reopener->diag.text);
		return;
	}
	if (!same_images(&before, &reopener->device.granted)) {
		log_about(LOG_LEVEL_ERROR, &camera,
			  "camera %s: came back with images of another size or format: it stays "
			  "out; restart the station",
			  capture->name);
		atomic_store(&capture->state, CAPTURE_STOPPED);
		reopener->device.driver->close(reopener->device.camera);
		return;
	}
	capture->device = reopener->device;
	if (!station_state_captures(station->state)) {
		capture->lost_since_ns = 0;
		atomic_store(&capture->state, CAPTURE_STOPPED);
		log_about(LOG_LEVEL_INFO, &camera, "camera %s: is back", capture->name);
	} else if (start_again(station, reopener->camera, &diag) == 0) {
		atomic_fetch_add(&capture->counters.reopened, 1);
		log_about(LOG_LEVEL_INFO, &camera, "camera %s: is back", capture->name);
	} else {
		capture_lose(capture, diag.text ? diag.text : "it does not start");
	}
	diag_finish(&diag);
}

static const char *damage_cause(const struct capture *capture)
{
	if (capture->device.driver != &files_camera_driver || !capture->device.camera)
		return "the frames come incomplete";
	return files_camera_problem(capture->device.camera);
}

static void watch_damage(const struct station *station, struct capture *capture)
{
	struct log_fields camera = about(station, capture);
	uint64_t bad = atomic_load(&capture->counters.damaged) +
		       atomic_load(&capture->counters.wrong_size);

	if (!bad || capture->damage_told)
		return;
	capture->damage_told = true;
	log_about(LOG_LEVEL_WARNING, &camera,
		  "camera %s: damaged images, missing from their shots: %s; stagectl status "
		  "counts them",
		  capture->name, damage_cause(capture));
}

static const char *lost_cause(const struct capture *capture)
{
	int error = atomic_load(&capture->lost_error);

	return error == -ENODEV ? "the device is gone" : strerror(-error);
}

/* Each kind of event once; the counters tell how often. */
static void watch_ledger(struct station *station, uint32_t index)
{
	const struct camera_events *events = &station->solver.book.cameras[index];
	struct capture *capture = &station->captures[index];

	for (int e = 0; e < LEDGER_EVENT_COUNT; e++) {
		if (!atomic_load(&events->counts[e]) || (capture->events_told >> e & 1))
			continue;
		capture->events_told |= UINT32_C(1) << e;
		log_about(LOG_LEVEL_WARNING,
			  &(struct log_fields){capture->name, atomic_load(&events->last_shot)},
			  "camera %s: %s, first about shot %" PRIu64
			  "; docs/faults.md says what that is, stagectl status counts it",
			  capture->name, ledger_event_name((enum ledger_event)e),
			  (uint64_t)atomic_load(&events->last_shot));
	}
}

static void watch_camera(struct station *station, uint32_t index)
{
	struct capture *capture = &station->captures[index];
	struct log_fields camera = about(station, capture);
	int state = atomic_load(&capture->state);

	watch_damage(station, capture);
	watch_ledger(station, index);
	if (state == CAPTURE_RUNNING)
		return;
	if (capture->thread.joinable) {
		if (!capture_stop(capture))
			return; /* hangs on its way out: named as such, tried again */
		if (state == CAPTURE_LOST) {
			capture_lose(capture, lost_cause(capture));
			log_about(LOG_LEVEL_WARNING, &camera,
				  "camera %s: lost: %s; the station runs on without it and looks "
				  "for it every second",
				  capture->name, capture->lost_why);
		}
		if (state == CAPTURE_ENDED)
			log_about(LOG_LEVEL_INFO, &camera, "camera %s: the recording is over",
				  capture->name);
	}
	if (state == CAPTURE_LOST &&
	    reopen_begin(&station->reopener, &station->stage, camera_drivers,
			 trigger_fires(trigger_drivers, station->stage.config.trigger), index,
			 &capture->device))
		capture->device.camera = NULL;
}

/* One line of what is said, without its end. */
static void lose_trigger(struct pulses *pulses, const char *why)
{
	if (!pulses->lost_since_ns)
		pulses->lost_since_ns = clock_now_ns();
	snprintf(pulses->lost_why, sizeof(pulses->lost_why), "%.*s", (int)strcspn(why, "\n"), why);
}

static void take_trigger_back(struct station *station)
{
	struct trigger_reopener *reopener = &station->trigger_reopener;
	struct pulses *pulses = &station->pulses;
	struct diag diag = {0};

	if (reopener->error) {
		lose_trigger(pulses, reopener->diag.text ? reopener->diag.text
							 : strerror(-reopener->error));
		return;
	}
	if (pulses_take_back(pulses, reopener->trigger, station_state_captures(station->state),
			     &diag) == 0) {
		pulses->accounts.reopened++;
		log_about(LOG_LEVEL_INFO, &(struct log_fields){.shot = station->newest_shot},
			  "trigger %s: is back", station->stage.config.trigger);
	} else {
		lose_trigger(pulses, diag.text ? diag.text : "it cannot be armed");
	}
	diag_finish(&diag);
}

static const char *trigger_cause(const struct pulses *pulses)
{
	int error = atomic_load(&pulses->lost_error);

	return error == -ENODEV       ? "the device is gone"
	       : error == -EOWNERDEAD ? "the lines' guard has ended"
				      : strerror(-error);
}

static void watch_trigger(struct station *station)
{
	struct pulses *pulses = &station->pulses;
	const char *address = station->stage.config.trigger;

	if (trigger_reopen_poll(&station->trigger_reopener))
		take_trigger_back(station);
	if (!atomic_load(&pulses->lost) || !realtime_thread_join(&pulses->thread))
		return; /* a thread that hangs on its way out is named as such */
	if (!pulses->lost_since_ns) {
		lose_trigger(pulses, trigger_cause(pulses));
		log_about(LOG_LEVEL_ERROR, &(struct log_fields){.shot = station->newest_shot},
			  "trigger %s: lost: %s; the station looks for it every second", address,
			  pulses->lost_why);
	}
	if (!station->trigger_reopener.errand.busy) {
		struct trigger *gone = pulses_give_up(pulses);

		if (!trigger_reopen_begin(&station->trigger_reopener, pulses->driver, address,
					  gone))
			pulses->trigger = gone;
	}
}

double station_unnamed_s(const struct station *station)
{
	uint32_t blocks = atomic_load(&station->solver.book.names.blocks);
	double seconds = blocks * (double)NAMING_BLOCK_NS / NS_PER_S;

	return station->state == STATION_RUNNING && seconds >= UNNAMED_MIN_S ? seconds : 0;
}

static void watch_names(struct station *station)
{
	const struct names_seen *names = &station->solver.book.names;

	if (station->unnamed_told || station_unnamed_s(station) <= 0)
		return;
	station->unnamed_told = true;
	log_about(LOG_LEVEL_WARNING, &(struct log_fields){.shot = station->newest_shot},
		  "no names: cameras see %.0f spots a picture, of which %.1f points and %.1f of %u "
		  "markers a shot are made: %s",
		  atomic_load(&names->spots), atomic_load(&names->points),
		  atomic_load(&names->named), station->stage.layout.marker_count,
		  naming_remedy((enum naming)atomic_load(&names->naming)));
}

static bool all_ended(const struct station *station)
{
	bool ended = true;

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		ended &= atomic_load(&station->captures[c].state) == CAPTURE_ENDED;
	return ended;
}

void station_tick(struct station *station)
{
	uint32_t camera_count = station->stage.config.camera_count;

	statistics_update(&station->statistics, station->captures, camera_count,
			  atomic_load(&station->solver.shots), clock_now_ns());
	if (reopen_poll(&station->reopener))
		take_back(station);
	watch_heartbeats(station);
	pulses_account(&station->pulses, station->stage.config.trigger);
	watch_trigger(station);
	watch_names(station);
	/* from the one behind the last that was tried: each lost camera has its turn */
	for (uint32_t i = 1, tried = station->reopener.camera; i <= camera_count; i++)
		watch_camera(station, (tried + i) % camera_count);
	if (all_ended(station) && station_next_state(station->state, STATION_OVER, &station->state))
		log_info("all recordings are over; the station stays up until it is stopped");
}
