/*
 * Starts and kills the programs of the closed rig.
 */
#include "tests/hil/rig_programs.h"

#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"

#define PATIENCE_NS (30 * NS_PER_S)
#define ARGUMENTS_MAX 16

/* Programs do not outlive the test. */
static pid_t start(const char *build, const char *program, const char *const *arguments)
{
	const char *all[ARGUMENTS_MAX] = {program};
	char path[256];
	pid_t child = fork();

	if (child == 0) {
		for (int i = 0; i < ARGUMENTS_MAX - 2 && arguments[i]; i++)
			all[i + 1] = arguments[i];
		snprintf(path, sizeof(path), "%s/%s", build, program);
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		execv(path, (char **)all);
		_exit(127);
	}
	assert_true(child > 0);
	return child;
}

void rig_plug_in(struct rig_programs *rig, int index, const char *fault, const char *value)
{
	char bus[4], serial[8], pictures[256];
	const char *arguments[] = {"--bus",  bus,      "--serial",  serial,   "--pictures",
				   pictures, "--gpio", rig->device, "--line", "0",
				   fault,    value,    NULL};

	snprintf(bus, sizeof(bus), "%d", index);
	snprintf(serial, sizeof(serial), "IR%d", index);
	snprintf(pictures, sizeof(pictures), "%s/hil-pictures/ir%d", rig->build, index);
	rig->cameras[index] = start(rig->build, "tests/hil/uvc_camera", arguments);
}

/* Until its socket is there; opening the cameras takes a while, and they may not be there yet. */
void rig_start_station(struct rig_programs *rig)
{
	const char *arguments[] = {"--config", NULL, "--socket-dir", rig->dir, NULL};
	int64_t until_ns = clock_now_ns() + PATIENCE_NS;
	char config[128], stream[128];
	int err = -ENOENT;

	snprintf(config, sizeof(config), "%s/stage.yaml", rig->dir);
	snprintf(stream, sizeof(stream), "%s/stream.sock", rig->dir);
	arguments[1] = config;
	while (err && clock_now_ns() < until_ns) {
		if (rig->station == 0)
			rig->station = start(rig->build, "daemon/staged", arguments);
		clock_sleep_until(clock_now_ns() + 200 * NS_PER_MS);
		err = stage_client_open(&rig->client, stream);
		if (waitpid(rig->station, NULL, WNOHANG) == rig->station)
			rig->station = 0; /* it said why */
	}
	assert_int_equal(err, 0);
	assert_true(rig->station > 0);
}

void rig_kill(pid_t *program, int signal_number)
{
	if (*program <= 0)
		return;
	kill(*program, signal_number);
	waitpid(*program, NULL, 0);
	*program = 0;
}

int rig_next_event(struct rig_programs *rig, struct stage_event *out)
{
	return stage_client_next(rig->client, (int)(PATIENCE_NS / NS_PER_MS), out);
}

void rig_end(struct rig_programs *rig)
{
	stage_client_close(rig->client);
	rig->client = NULL;
	rig_kill(&rig->station, SIGTERM);
	rig_kill(&rig->cameras[0], SIGKILL);
	rig_kill(&rig->cameras[1], SIGKILL);
}
