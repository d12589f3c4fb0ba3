/*
 * Configuring, starting and stopping the station, in the order that leaves nothing half-started:
 * files, simulated world, cameras, trigger; then captures, solver, trigger last.
 */
#include "daemon/station.h"

#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "base/clock_virtual.h"
#include "base/log.h"
#include "daemon/accounts.h"
#include "daemon/program_drivers.h"
#include "daemon/realtime.h"
#include "daemon/station_light.h"
#include "drivers/files/files.h"
#include "sim/world/world.h"

#define QUEUE_NS                                                                        \
	(300 * NS_PER_MS) /* a stall of the solver or of the control thread is survived \
			   */
#define QUEUE_MIN 16
#define SLOWER_SHARE 200        /* half a percent of the period is rounding */
#define PERIOD_MIN_NS NS_PER_MS /* a recording may claim anything */

/* By the faster of the plan and what the cameras were granted: they may run free. */
static uint32_t queue_length(const struct station *station)
{
	int64_t period_ns = station->stage.config.plan.period_ns;

	if (station->period_ns > 0 && station->period_ns < period_ns)
		period_ns = station->period_ns;
	int64_t length = QUEUE_NS / (period_ns > PERIOD_MIN_NS ? period_ns : PERIOD_MIN_NS) + 2;

	return length > QUEUE_MIN ? (uint32_t)length : QUEUE_MIN;
}

/* What a failed open says: a file that is missing or wrong is bad input (a recording, or its
 * address); all else is the device. */
static enum exit_code open_exit_code(int err)
{
	switch (err) {
	case -ENOENT:
	case -ENOTDIR:
	case -EACCES:
	case -ENAMETOOLONG:
	case -EINVAL:
	case -EBADMSG:
	case -EPROTO:
	case -EILSEQ:
		return EXIT_CODE_BAD_INPUT;
	default:
		return exit_code_of(err, EXIT_CODE_DEVICE);
	}
}

static int stall_disk(const struct config *config, const struct sim_fault *fault,
		      struct open_camera *devices, struct diag *diag)
{
	double until_s = fault->for_s > 0 ? fault->at_s + fault->for_s : INT64_MAX / 2e9;
	struct files_stall stall = {(int64_t)(fault->at_s * 1e9), (int64_t)(until_s * 1e9),
				    (int64_t)(fault->delay_ms * 1e6), fault->every};
	int err = 0;

	for (uint32_t c = 0; c < config->camera_count; c++)
		if (strcmp(config->cameras[c].name, fault->camera) == 0 && devices[c].camera)
			err = files_camera_stall(devices[c].camera, &stall);
	if (err)
		diag_add(diag, "sim.faults: camera %s: more than %d times slow_disk", fault->camera,
			 FILES_STALL_MAX);
	return err;
}

/* Of recordings, the faults that are asked for. */
static int stall_disks(const struct config *config, struct open_camera *devices, struct diag *diag)
{
	int err = 0;

	for (uint32_t i = 0; !err && i < config->sim_faults.count; i++)
		if (config->sim_faults.faults[i].kind == SIM_FAULT_SLOW_DISK)
			err = stall_disk(config, &config->sim_faults.faults[i], devices, diag);
	return err;
}

/* Hands the open devices to the captures; closes those that could not be handed over. */
static int init_captures(struct station *station, struct open_camera *devices, struct diag *diag)
{
	const struct config *config = &station->stage.config;
	int err = 0;

	for (uint32_t c = 0; c < config->camera_count; c++) {
		struct capture *capture = &station->captures[c];
		struct blob_settings blobs = config_blobs(config, c);

		if (!err)
			err = capture_init(capture, &config->cameras[c], &devices[c], &blobs,
					   queue_length(station));
		if (!err)
			devices[c].camera = NULL;
		capture->control_wake_fd = station->wake_fd;
		capture->solver_wake = &station->solver.wake;
	}
	close_cameras(devices, config->camera_count);
	if (err)
		diag_add(diag, "out of memory for the cameras' queues");
	return err;
}

static int open_pulses(struct station *station, struct diag *diag)
{
	const struct config *config = &station->stage.config;
	int err = pulses_open(&station->pulses, config->trigger, &config->plan, trigger_drivers,
			      queue_length(station), diag);

	station->pulses.solver_wake = &station->solver.wake;
	return err;
}

/* Of the shots: the trigger's, or the cameras' own. */
static int64_t find_period_ns(const struct station *station)
{
	struct open_camera devices[CAMERA_MAX];

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		devices[c] = station->captures[c].device;
	int64_t granted_ns = open_cameras_period_ns(devices, station->stage.ir_mask);

	return station->pulses.driver->reports_edges || !granted_ns ? station->plan->period_ns
								    : granted_ns;
}

static int init_solver(struct station *station)
{
	bool has_edges = station->pulses.driver->reports_edges;

	station->period_ns = find_period_ns(station);
	int err = rig_swap_init(&station->rig_swap, &station->stage, station->wake_fd);
	return err ? err
		   : solver_init(&station->solver, &station->stage, &station->rig_swap.handover,
				 station->captures, has_edges ? &station->pulses : NULL,
				 &station->shot_copy, station->wake_fd, queue_length(station));
}

/* Only where the trigger sets the pace: cameras that run free have their own. */
static void name_slow_cameras(const struct station *station)
{
	const struct trigger_plan *plan = station->plan;

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++) {
		const struct capture *capture = &station->captures[c];
		int64_t period_ns =
			plan->period_ns * (capture->role == ROLE_HD ? plan->hd_divider : 1);
		int64_t granted_ns = capture->device.granted.period_ns;

		if (granted_ns <= period_ns + period_ns / SLOWER_SHARE)
			continue;
		log_about(LOG_LEVEL_WARNING, &(struct log_fields){capture->name, LOG_NO_SHOT},
			  "camera %s: slower than its trigger: at most %.6g Hz, triggered at %.6g "
			  "Hz; it will miss shots: lower rate_hz, or its exposure or image size",
			  capture->name, (double)NS_PER_S / (double)granted_ns,
			  (double)NS_PER_S / (double)period_ns);
	}
}

/* Of a rig that comes later: it is checked against these. */
static void expect_sizes(struct stage *stage, const struct open_camera *devices)
{
	for (uint32_t left = stage->ir_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		struct view *view = &stage->rig.views[stage->view_index[c]];

		view->width_px = devices[c].granted.width_px;
		view->height_px = devices[c].granted.height_px;
	}
}

static enum exit_code open_devices(struct station *station, struct diag *diag)
{
	struct open_camera devices[CAMERA_MAX];

	virtual_time_begin(&station->virtual_time, &station->stage.config);
	station->plan = &station->stage.config.plan;
	int err = station_open_world(station, diag);

	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	err = open_cameras(devices, &station->stage, UINT32_MAX, camera_drivers,
			   trigger_fires(trigger_drivers, station->stage.config.trigger), diag);
	if (err)
		return open_exit_code(err);
	if (stall_disks(&station->stage.config, devices, diag) < 0) {
		close_cameras(devices, station->stage.config.camera_count);
		return EXIT_CODE_BAD_INPUT;
	}
	if (!station->stage.has_rig)
		expect_sizes(&station->stage, devices);
	station->period_ns = open_cameras_period_ns(devices, station->stage.ir_mask);
	if (init_captures(station, devices, diag) < 0)
		return EXIT_CODE_INTERNAL;
	err = open_pulses(station, diag);
	if (err)
		return open_exit_code(err);
	if (station->pulses.driver->reports_edges)
		name_slow_cameras(station);
	return init_solver(station) < 0 ? EXIT_CODE_INTERNAL : EXIT_CODE_OK;
}

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
	enum exit_code code = open_devices(station, diag);

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
	station->period_ns = find_period_ns(station);
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
		return open_exit_code(err);
	}
	station->started_ns = station->statistics.last_ns = clock_now_ns();
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
