/*
 * Configuring, starting and stopping the station, in the order that leaves nothing half-started:
 * files and devices (station_open.c); then captures, solver, trigger last.
 */
#include "daemon/station.h"

#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/clock_virtual.h"
#include "base/log.h"
#include "daemon/accounts.h"
#include "daemon/realtime.h"
#include "daemon/station_light.h"
#include "daemon/station_open.h"
#include "sim/world/world.h"

enum exit_code station_load(struct station *station, const char *config_path, struct diag *diag)
{
	memset(station, 0, sizeof(*station));
	station->newest_shot = LOG_NO_SHOT;
	station->wake_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
	int err = stage_load_to_calibrate(&station->stage, config_path, diag);

	if (err)
		station_finish(station);
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

enum exit_code station_configure(struct station *station, struct diag *diag)
{
	enum exit_code code = station_open_devices(station, diag);

	if (code != EXIT_CODE_OK) {
		station_finish(station);
		return code;
	}
	station_next_state(station->state, STATION_CONFIGURE, &station->state);
	return EXIT_CODE_OK;
}

/* What the last run left behind. */
static void begin_run(struct station *station, bool solve)
{
	station->run++;
	station->sim_late_before = sim_late_since_open(station);
	memset(&station->statistics, 0, sizeof(station->statistics));
	pulses_begin_run(&station->pulses);
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		capture_begin_run(&station->captures[c]);
	solver_begin_run(&station->solver, &(struct solver_run){station->plan, station->period_ns,
								solve, station->run});
}

/* One that is gone is lost, not a failure, when it is to start. */
static int set_light(struct station *station, struct diag *diag)
{
	int err = 0;

	for (uint32_t c = 0; c < station->stage.config.camera_count && !err; c++) {
		struct capture *capture = &station->captures[c];
		struct camera_mode wanted = station_wanted(station, c);
		struct diag said = {0};

		if (capture->device.camera)
			err = capture_set_light(capture, &wanted, &said);
		if (err == -ENODEV)
			err = 0;
		else if (err)
			diag_add(diag, "%s", said.text ? said.text : strerror(-err));
		diag_finish(&said);
	}
	return err;
}

/* The light, and the period that follows from it. */
static int begin_light(struct station *station, bool calibrating, struct diag *diag)
{
	int err = station_begin_light(station, calibrating, diag);

	if (!err)
		err = set_light(station, diag);
	station->period_ns = station_find_period_ns(station);
	return err;
}

/* A device that went away while nothing ran is looked for like one that is lost while live. */
static int start_capture(struct capture *capture, struct diag *diag)
{
	struct diag said = {0};
	int err = capture->device.camera ? capture_start(capture, &said) : -ENODEV;

	if (err == -ENODEV) {
		capture_lose(capture, said.text ? said.text : "the device is gone");
		err = 0;
	} else if (err) {
		diag_add(diag, "%s", said.text ? said.text : strerror(-err));
	}
	diag_finish(&said);
	return err;
}

static int start_threads(struct station *station, struct diag *diag)
{
	int err = solver_start(&station->solver, diag);

	for (uint32_t c = 0; c < station->stage.config.camera_count && !err; c++)
		err = start_capture(&station->captures[c], diag);
	return err ? err : pulses_start(&station->pulses, diag);
}

static void stop_threads(struct station *station)
{
	clock_rush_begin();
	bool ended = pulses_stop(&station->pulses);

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		capture_tell_to_stop(&station->captures[c]);
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		ended &= capture_stop(&station->captures[c]);
	ended &= solver_stop(&station->solver);
	clock_rush_end();
	station->hung |= !ended;
}

bool station_has_rig(const struct station *station)
{
	/* the one that it was configured with, or one that came later */
	return station->stage.has_rig || station->rig_swap.current->serial > 1;
}

enum exit_code station_start(struct station *station, enum station_event how, struct diag *diag)
{
	enum station_state to;

	if (!station_next_state(station->state, how, &to)) {
		diag_add(diag, "the station is %s: stop it first",
			 station_state_name(station->state));
		return EXIT_CODE_RUNNING;
	}
	if (how == STATION_START && !station_has_rig(station)) {
		diag_add(diag, STATION_NO_RIG, station->stage.config.rig_dir);
		return EXIT_CODE_BAD_INPUT;
	}
	if (station->hung) {
		diag_add(diag, "a thread hangs in its driver: restart the station");
		return EXIT_CODE_DEVICE;
	}
	int err = begin_light(station, how == STATION_CALIBRATE, diag);

	station->memory_locked = realtime_lock_memory();
	begin_run(station, how == STATION_START);
	clock_hold(); /* all start at the same moment of virtual time */
	if (!err)
		err = start_threads(station, diag);
	if (err) {
		stop_threads(station);
		if (!station->hung)
			station_end_light(station);
		clock_release();
		return station_open_exit_code(err);
	}
	station->started_ns = station->statistics.last_ns = clock_now_ns();
	station->unnamed_told = false;
	station->state = to;
	clock_release();
	if (!clock_is_virtual() && !station_is_realtime(station))
		log_warning("normal scheduling, because SCHED_FIFO is not allowed: latencies are "
			    "not bounded; set LimitRTPRIO=99 in the unit");
	return EXIT_CODE_OK;
}

bool station_stop(struct station *station)
{
	enum station_state to;

	if (!station_next_state(station->state, STATION_STOP, &to))
		return false;
	stop_threads(station);
	if (!station->hung)
		station_end_light(station);
	station->state = to;
	return true;
}

bool station_finish(struct station *station)
{
	station_stop(station);
	if (station->hung || !reopen_finish(&station->reopener) ||
	    !trigger_reopen_finish(&station->trigger_reopener))
		return false;
	solver_finish(&station->solver);
	rig_swap_finish(&station->rig_swap);
	pulses_close(&station->pulses);
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		capture_finish(&station->captures[c]);
	if (station->world_open)
		sim_world_close();
	if (station->wake_fd > 0)
		close(station->wake_fd);
	stage_finish(&station->stage);
	memset(station, 0, sizeof(*station));
	return true;
}

const struct marker_set *station_next_set(struct station *station)
{
	return ring_peek(&station->solver.sets, 0);
}

void station_pop_set(struct station *station)
{
	statistics_add_set(&station->statistics, ring_peek(&station->solver.sets, 0),
			   clock_now_ns());
	ring_pop(&station->solver.sets);
	clock_release();
}
