/*
 * Programs are taken from the build directory that this one runs in.
 */
#include "demo/stand.h"

#include <errno.h>
#include <ftw.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "demo/stress.h"

#define GIGE_CAMERAS 4
#define GIGE_RATE_HZ 60
#define SIM_CAMERAS 8
#define SIM_RATE_HZ 120
#define CALIBRATION_RATE_MIN_HZ 2
#define CALIBRATION_RATE_MAX_HZ 12
#define CAMERAS_PATIENCE_NS (15 * NS_PER_S)
#define FIRST_HOST 11 /* of the cameras: 127.0.x.11 and on */

/* Two demonstrations at a time must not ask for the same addresses. */
static int network(void)
{
	return 1 + getpid() % 250;
}

int stand_program(char *path, size_t size, const char *below_build, struct diag *diag)
{
	char self[3000];
	ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);

	if (length < 0) {
		diag_add(diag, "/proc/self/exe: %s: is /proc mounted?", strerror(errno));
		return -ENOENT;
	}
	self[length] = '\0';
	for (int up = 0; up < 2; up++) {
		char *slash = strrchr(self, '/');

		if (slash)
			*slash = '\0';
	}
	snprintf(path, size, "%s/%s", self, below_build);
	if (access(path, X_OK) == 0)
		return 0;
	diag_add(diag, "%s: %s: build everything first (./stage build)", path, strerror(errno));
	return -ENOENT;
}

static int make_dir(struct stand *stand, const struct demo_options *options, struct diag *diag)
{
	const char *parent = getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp";

	if (options->keep_dir) {
		snprintf(stand->dir, sizeof(stand->dir), "%s", options->keep_dir);
		stand->keep_dir = true;
		return 0; /* made with the files in it */
	}
	snprintf(stand->dir, sizeof(stand->dir), "%s/stage-demo-XXXXXX", parent);
	if (!mkdtemp(stand->dir)) {
		int r = -errno;

		diag_add(diag, "%s: cannot make a directory there: %s: set TMPDIR", parent,
			 strerror(-r));
		stand->dir[0] = '\0';
		return r;
	}
	return 0;
}

/* The board's pictures are rendered and searched on the same processors. */
static void add_calibration(const struct stand *stand, char *extra, size_t size)
{
	const struct board *board = sim_scene_board(stand->scene);
	long processors = sysconf(_SC_NPROCESSORS_ONLN);
	int rate_hz = processors < CALIBRATION_RATE_MIN_HZ   ? CALIBRATION_RATE_MIN_HZ
		      : processors > CALIBRATION_RATE_MAX_HZ ? CALIBRATION_RATE_MAX_HZ
							     : (int)processors;
	size_t used = strlen(extra);

	snprintf(extra + used, size - used,
		 "calibration: {rate_hz: %d, board: {squares_x: %d, squares_y: %d, square_m: %g, "
		 "tag_part: %g, first_id: %d}}\n",
		 rate_hz, board->squares_x, board->squares_y, board->square_m, board->tag_part,
		 board->first_id);
}

static int remove_entry(const char *path, const struct stat *st, int kind, struct FTW *where)
{
	(void)st;
	(void)kind;
	(void)where;
	return remove(path);
}

/* The station is to have none but the one that it makes. */
static int remove_rig(const struct stand *stand, struct diag *diag)
{
	char path[sizeof(stand->dir) + 8];

	snprintf(path, sizeof(path), "%s/rig", stand->dir);
	if (nftw(path, remove_entry, 8, FTW_DEPTH | FTW_PHYS) == 0)
		return 0;
	int r = -errno;
	diag_add(diag, "%s: cannot be removed: %s", path, strerror(-r));
	return r;
}

static int write_files(const struct stand *stand, const struct demo_options *options,
		       struct diag *diag)
{
	char extra[9000], faults[200] = "", addresses[CAMERA_MAX][80];
	const char *pointers[CAMERA_MAX];

	for (uint32_t i = 0; i < stand->camera_count + stand->hd_count; i++) {
		if (options->sim)
			snprintf(addresses[i], sizeof(addresses[i]), "sim:%s",
				 sim_scene_camera_name(stand->scene, i));
		else
			snprintf(addresses[i], sizeof(addresses[i]), "aravis:127.0.%d.%u",
				 network(), FIRST_HOST + i);
		pointers[i] = addresses[i];
	}
	int used = snprintf(extra, sizeof(extra), "socket_dir: \"%s\"\n", stand->dir);
	if (options->stress)
		stress_faults_yaml(faults, sizeof(faults), options->seconds);
	if (options->sim)
		snprintf(extra + used, sizeof(extra) - (size_t)used,
			 "trigger: sim\nsim: {scene: \"%s\", seed: %" PRIu64 ", epoch_ns: %" PRId64
			 "%s}\n",
			 options->scene, options->seed, stand->epoch_ns, faults);
	if (options->calibrate)
		add_calibration(stand, extra, sizeof(extra));
	int r = sim_scene_write_stage(stand->scene, stand->dir, pointers, extra, diag);
	return r < 0 || !options->calibrate ? r : remove_rig(stand, diag);
}

int stand_init(struct stand *stand, const struct demo_options *options, struct diag *diag)
{
	memset(stand, 0, sizeof(*stand));
	stand->camera_count = options->sim ? SIM_CAMERAS : GIGE_CAMERAS;
	stand->hd_count = options->hd_count;
	stand->rate_hz = options->sim ? SIM_RATE_HZ : GIGE_RATE_HZ;
	struct sim_options scene = {.scene = options->scene,
				    .seed = options->seed,
				    .camera_count = stand->camera_count,
				    .rate_hz = stand->rate_hz,
				    .hd_camera_count = stand->hd_count};
	int r = sim_scene_create(&stand->scene, &scene, diag);
	if (r == 0)
		r = make_dir(stand, options, diag);
	if (r < 0)
		return r;
	snprintf(stand->socket_path, sizeof(stand->socket_path), "%s/stream.sock", stand->dir);
	stand->epoch_ns = clock_now_ns();
	return write_files(stand, options, diag);
}

static int wait_for_cameras(struct stand *stand, struct diag *diag,
			    const volatile sig_atomic_t *stop)
{
	int64_t deadline_ns = clock_now_ns() + CAMERAS_PATIENCE_NS;
	char line[512];

	while (!child_find_line(&stand->cameras, "ready", line, sizeof(line))) {
		if (*stop)
			return -EINTR;
		if (!child_is_running(&stand->cameras))
			return -ECHILD;
		if (clock_now_ns() > deadline_ns) {
			diag_add(diag, "the simulated cameras did not get ready in time");
			return -ETIMEDOUT;
		}
		clock_sleep_until(clock_now_ns() + 20 * NS_PER_MS);
	}
	return 0;
}

int stand_start_cameras(struct stand *stand, const struct demo_options *options, struct diag *diag,
			const volatile sig_atomic_t *stop)
{
	char program[4096], seed[24], count[12], rate[24], epoch[24], address[24];

	if (options->sim)
		return 0;
	int r = stand_program(program, sizeof(program), "sim/stage-sim-gige", diag);
	if (r < 0)
		return r;
	snprintf(seed, sizeof(seed), "%" PRIu64, options->seed);
	snprintf(count, sizeof(count), "%u", stand->camera_count);
	snprintf(rate, sizeof(rate), "%g", stand->rate_hz);
	snprintf(epoch, sizeof(epoch), "%" PRId64, stand->epoch_ns);
	snprintf(address, sizeof(address), "127.0.%d.%d", network(), FIRST_HOST);
	char *argv[] = {program,      "--scene", (char *)(uintptr_t)options->scene,
			"--seed",     seed,      "--cameras",
			count,        "--rate",  rate,
			"--epoch-ns", epoch,     "--first-address",
			address,      NULL};
	r = child_start(&stand->cameras, "cameras", stand->dir, argv, diag);
	return r < 0 ? r : wait_for_cameras(stand, diag, stop);
}

int stand_start_station(struct stand *stand, bool idle, struct diag *diag)
{
	char program[4096], config[4200];
	int r = stand_program(program, sizeof(program), "daemon/staged", diag);

	if (r < 0)
		return r;
	snprintf(config, sizeof(config), "%s/stage.yaml", stand->dir);
	char *argv[] = {program, "--config", config, idle ? "--idle" : NULL, NULL};
	return child_start(&stand->station, "station", stand->dir, argv, diag);
}

void stand_stop(struct stand *stand)
{
	child_stop(&stand->calibration);
	child_stop(&stand->station);
	child_stop(&stand->cameras);
}

bool stand_camera_counts(const struct stand *stand, struct camera_counts *out)
{
	struct camera_counts counts;
	char line[512];

	if (!stand->cameras.name ||
	    !child_find_line(&stand->cameras, "ended", line, sizeof(line)) ||
	    sscanf(line,
		   "ended frames_sent=%" SCNu64 " frames_late=%" SCNu64 " shots_skipped=%" SCNu64,
		   &counts.frames_sent, &counts.frames_late, &counts.frames_skipped) != 3)
		return false;
	*out = counts;
	return true;
}

void stand_finish(struct stand *stand)
{
	stand_stop(stand);
	if (stand->dir[0] && !stand->keep_dir)
		nftw(stand->dir, remove_entry, 8, FTW_DEPTH | FTW_PHYS);
	sim_scene_destroy(stand->scene);
	memset(stand, 0, sizeof(*stand));
}
