/*
 * People see what stagectl tells them on stderr; what came of it, the list of revisions says.
 */
#include "demo/calibrate.h"

#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/control_client.h"

#define LISTEN_PATIENCE_NS (20 * NS_PER_S)
#define GATHER_S "75" /* then it is solved, whatever is missing */

static int wait_for_station(struct stand *stand, const volatile sig_atomic_t *stop,
			    struct diag *diag)
{
	int64_t deadline_ns = clock_now_ns() + LISTEN_PATIENCE_NS;
	char path[sizeof(stand->dir) + 16];

	snprintf(path, sizeof(path), "%s/control.sock", stand->dir);
	while (access(path, F_OK) < 0) {
		if (*stop)
			return -EINTR;
		if (!child_is_running(&stand->station))
			return -ECHILD;
		if (clock_now_ns() > deadline_ns) {
			diag_add(diag, "%s: the station does not listen", path);
			return -ETIMEDOUT;
		}
		clock_sleep_until(clock_now_ns() + 20 * NS_PER_MS);
	}
	return 0;
}

/* Ends with the program, or when it is told to stop. */
static int run_child(struct child *child, const char *name, char *const argv[],
		     const struct stand *stand, const volatile sig_atomic_t *stop,
		     struct diag *diag)
{
	int r = child_start_told(child, name, stand->dir, argv, diag);

	while (r == 0 && !*stop && child_is_running(child))
		clock_sleep_until(clock_now_ns() + 50 * NS_PER_MS);
	child_stop(child);
	return r == 0 && *stop ? -EINTR : r;
}

/* Of the list's last revision. */
static void read_revision(struct calibration_report *report, const char *path)
{
	json_t *list = json_load_file(path, 0, NULL);
	const json_t *last = json_array_get(list, json_array_size(list) - 1);

	report->passed = json_is_true(json_object_get(last, "in_force"));
	report->poses = (uint32_t)json_integer_value(json_object_get(last, "poses"));
	report->rms_px = json_number_value(json_object_get(last, "rms_px"));
	report->worst_mm = json_number_value(json_object_get(last, "worst_mm"));
	json_decref(list);
}

static int run_stagectl(struct calibration_report *report, struct stand *stand,
			const volatile sig_atomic_t *stop, struct diag *diag)
{
	char program[4096], config[sizeof(stand->dir) + 16];
	struct child list = {0};
	int r = stand_program(program, sizeof(program), "ctl/stagectl", diag);

	if (r < 0)
		return r;
	snprintf(config, sizeof(config), "%s/stage.yaml", stand->dir);
	char *cameras[] = {program,  "calibrate",    "cameras",  "--seconds",
			   GATHER_S, "--socket-dir", stand->dir, NULL};
	char *revisions[] = {program, "calibrate", "list", config, "--json", NULL};
	r = run_child(&stand->calibration, "calibration", cameras, stand, stop, diag);
	if (r == 0)
		r = run_child(&list, "revisions", revisions, stand, stop, diag);
	if (r == 0)
		read_revision(report, list.log_path);
	return r;
}

int demo_calibrate(struct calibration_report *report, struct stand *stand,
		   const volatile sig_atomic_t *stop, struct diag *diag)
{
	int64_t begin_ns = clock_now_ns();
	json_t *reply;
	int r = wait_for_station(stand, stop, diag);

	*report = (struct calibration_report){0};
	if (r == 0)
		r = run_stagectl(report, stand, stop, diag);
	if (r < 0)
		return r;
	report->seconds = (double)(clock_now_ns() - begin_ns) / 1e9;
	if (!report->passed) {
		diag_add(diag, "the calibration made no rig that is good enough");
		return -EINVAL;
	}
	if (control_ask(&reply, stand->dir, "org.stage.Control.Start", NULL) != 0)
		return -EIO;
	json_decref(reply);
	return 0;
}
