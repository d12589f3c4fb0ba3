/*
 * Opens what the config names: simulated world, cameras, trigger, and the queues between them.
 */
#include "daemon/station_open.h"

#include <errno.h>
#include <string.h>

#include "base/log.h"
#include "daemon/program_drivers.h"
#include "daemon/station_light.h"
#include "drivers/files/files.h"

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

enum exit_code station_open_exit_code(int err)
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

int64_t station_find_period_ns(const struct station *station)
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

	station->period_ns = station_find_period_ns(station);
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

enum exit_code station_open_devices(struct station *station, struct diag *diag)
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
		return station_open_exit_code(err);
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
		return station_open_exit_code(err);
	if (station->pulses.driver->reports_edges)
		name_slow_cameras(station);
	return init_solver(station) < 0 ? EXIT_CODE_INTERNAL : EXIT_CODE_OK;
}
