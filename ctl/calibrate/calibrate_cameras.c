/*
 * stagectl calibrate cameras: from a board that is waved before the running station, from pictures
 * of one, or from the corners kept from either, to a rig in force.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "calib/board/choose.h"
#include "calib/board/observations_file.h"
#include "calib/rig/rig_store.h"
#include "ctl/arguments.h"
#include "ctl/calibrate/calibrate_live.h"
#include "ctl/calibrate/calibrate_make.h"
#include "ctl/calibrate/calibrate_read.h"
#include "ctl/calibrate/calibrate_screen.h"
#include "ctl/calibrate/calibrate_told.h"
#include "ctl/control_client.h"
#include "ctl/print_json.h"

struct calibrate {
	const char *from, *config_path, *board_path, *out, *lens, *socket_dir;
	double seconds_max;
	bool json, accept_scale, has_config, from_corners;
	struct live_station station;
	struct config config;
	struct board board;
	char rig_dir[PATH_MAX];
	char kept_path[PATH_MAX]; /* the corners, kept */
	int lock_fd;              /* of the rig's store; -1: not yet */
	struct picture_counts counts[CAMERA_MAX];
	struct observations observations; /* chosen */
	struct camera_coverage coverage[CAMERA_MAX];
	uint32_t near_count;
	struct calibrate_making making;
};

static volatile sig_atomic_t stopped;

static void stop(int signal_number)
{
	(void)signal_number;
	stopped = 1;
}

/* From now on Ctrl-C ends the search and keeps what was found; with SIG_DFL it ends the program. */
static void on_signals(void (*handler)(int))
{
	const struct sigaction action = {.sa_handler = handler};

	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGHUP, &action, NULL);
}

static bool is_dir(const char *path)
{
	struct stat st;

	return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

static bool ends_with(const char *text, const char *end)
{
	size_t length = strlen(text), end_length = strlen(end);

	return length >= end_length && !strcmp(text + length - end_length, end);
}

static int load_config(struct calibrate *k, struct diag *diag)
{
	const char *from = k->from ? k->from : k->station.config_path;
	char path[PATH_MAX];

	if (!k->config_path && k->from_corners) {
		k->config.calibration = calibration_default();
		return 0;
	}
	if (k->config_path)
		snprintf(path, sizeof(path), "%s", k->config_path);
	else if (snprintf(path, sizeof(path), is_dir(from) ? "%s/stage.yaml" : "%s", from) >=
		 PATH_MAX)
		return -ENAMETOOLONG;
	k->has_config = true;
	return config_load(&k->config, path, diag);
}

static int find_board(struct calibrate *k, struct diag *diag)
{
	if (k->board_path)
		return board_load(&k->board, k->board_path, diag);
	k->board = k->config.calibration.board;
	if (k->from_corners || k->config.calibration.has_board)
		return 0;
	diag_add(diag,
		 "%s: calibration.board: missing; describe the board there, or give --board FILE",
		 k->config.path);
	return -EINVAL;
}

static int find_rig(struct calibrate *k, struct diag *diag)
{
	const char *dir = k->out ? k->out : k->has_config ? k->config.rig_dir : NULL;

	if (!dir) {
		diag_add(diag,
			 "%s: give --out RIG or --config FILE: these corners do not say "
			 "which rig is made",
			 k->from);
		return -EINVAL;
	}
	if (strlen(dir) >= RIG_STORE_PATH) {
		diag_add(diag, "%.60s...: path too long", dir);
		return -ENAMETOOLONG;
	}
	strcpy(k->rig_dir, dir);
	int err = rig_store_lock(&k->lock_fd, k->rig_dir, diag);
	return err ? err : rig_store_path(k->kept_path, k->rig_dir, "corners.vnl", true, diag);
}

/* What an interrupted calibration left is not overwritten by the next one. */
static int keep_earlier(const struct calibrate *k, struct diag *diag)
{
	char earlier[PATH_MAX];

	if (snprintf(earlier, sizeof(earlier), "%s", k->kept_path) >= PATH_MAX - 16)
		return -ENAMETOOLONG;
	memcpy(strrchr(earlier, '.'), ".before.vnl", sizeof(".before.vnl"));
	if (!rename(k->kept_path, earlier)) {
		fprintf(stderr, "the corners of a calibration that was not finished are in %s\n",
			earlier);
		return 0;
	}
	if (errno == ENOENT)
		return 0;
	diag_add(diag, "%s: cannot write: %s", earlier, strerror(errno));
	return -errno;
}

/* A rig for this config is for all of its cameras: a station would refuse it otherwise. */
static int check_cameras(const struct calibrate *k, struct diag *diag)
{
	int err = 0;

	for (uint32_t c = 0; k->has_config && !k->out && c < k->config.camera_count; c++) {
		bool found = false;

		for (uint32_t o = 0; o < k->observations.camera_count; o++)
			found |=
				!strcmp(k->config.cameras[c].name, k->observations.cameras[o].name);
		if (found)
			continue;
		diag_add(diag,
			 "camera %s: in %s, and not in these corners: calibrate all cameras "
			 "together, "
			 "or write to another rig with --out",
			 k->config.cameras[c].name, k->config.path);
		err = -EINVAL;
	}
	return err;
}

/* An exit code. */
static int prepare(struct calibrate *k, struct diag *diag)
{
	if (solve_check_lens(k->lens, diag))
		return EXIT_CODE_USAGE;
	int code = k->from ? 0 : calibrate_live_look(&k->station, k->socket_dir);

	if (code)
		return code;
	k->from_corners = k->from && ends_with(k->from, ".vnl");
	int err = load_config(k, diag);

	if (!err)
		err = find_board(k, diag);
	if (!err)
		err = find_rig(k, diag);
	if (!err && !k->from)
		err = keep_earlier(k, diag);
	return err == -EBUSY ? EXIT_CODE_RUNNING : exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

static void no_progress(const struct picture_progress *progress, void *user)
{
	(void)progress;
	(void)user;
}

static int read_pictures(struct calibrate *k, struct observations *all, struct diag *diag)
{
	return calibrate_read(all, k->counts, &k->config, &k->board, &stopped,
			      isatty(STDERR_FILENO) ? screen_progress : no_progress, NULL, diag);
}

static int look_at_pictures(struct calibrate *k, struct observations *all, struct diag *diag)
{
	const struct live_options live = {.socket_dir = k->socket_dir,
					  .kept_path = k->kept_path,
					  .seconds_max = k->seconds_max,
					  .json = k->json};

	on_signals(stop);
	int code = k->from ? (int)exit_code_of(read_pictures(k, all, diag), EXIT_CODE_BAD_INPUT)
			   : calibrate_live(all, k->counts, &k->config.calibration, &k->board,
					    &live, &stopped);
	on_signals(SIG_DFL);
	return code;
}

static int choose(struct calibrate *k, const struct observations *all)
{
	struct choose_settings settings = CHOOSE_SETTINGS_DEFAULT;

	settings.poses_max = (uint32_t)k->config.calibration.poses_max;
	int err = observations_choose(&k->observations, all, &settings, &k->near_count);
	return err ? err : coverage_find(k->coverage, &k->observations);
}

/* The corners are on the disk when it returns 0; else an exit code. */
static int gather(struct calibrate *k, struct diag *diag)
{
	struct observations all = {0};
	int code = k->from_corners ? (int)exit_code_of(observations_read(&all, k->from, diag),
						       EXIT_CODE_BAD_INPUT)
				   : look_at_pictures(k, &all, diag);

	if (code)
		return code;
	if (k->from_corners)
		k->board = all.board;
	int err = choose(k, &all);
	observations_finish(&all);
	if (!err && observations_write(&k->observations, k->kept_path, diag))
		return EXIT_CODE_INTERNAL;
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

static int make(struct calibrate *k, struct diag *diag)
{
	int err;

	k->making.rig_dir = k->rig_dir;
	k->making.kept_path = k->kept_path;
	k->making.lens = k->lens;
	k->making.accept_scale = k->accept_scale;
	k->making.calibration = &k->config.calibration;
	k->making.observations = &k->observations;
	k->making.coverage = k->coverage;
	err = check_cameras(k, diag);
	if (!err && !k->from_corners)
		err = calibrate_check_pictures(&k->observations, k->counts, &k->board,
					       k->config.calibration.blur_max_px, diag);
	if (!err) {
		fprintf(stderr, "solving: %u cameras, %u poses of the board\n",
			k->observations.camera_count, observations_pose_count(&k->observations));
		err = calibrate_make(&k->making, diag);
	}
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

static void print_result(const struct calibrate *k)
{
	if (!k->json) {
		calibrate_making_print(&k->making);
		return;
	}
	json_t *object = calibrate_making_json(&k->making);
	json_object_set_new(object, "event", json_string("result"));
	json_object_set_new(object, "near_duplicates", json_integer(k->near_count));
	json_object_set_new(object, "cameras",
			    screen_coverage_json(&k->observations, k->coverage,
						 k->from_corners ? NULL : k->counts));
	print_json(object);
}

/* The station's own rig: it uses the new one from its next shot on. */
static int reload(const struct calibrate *k)
{
	if (k->from || k->out || k->config_path)
		return EXIT_CODE_OK;
	int code = calibrate_live_reload(k->socket_dir);

	if (!code && !k->json)
		puts("the station uses it; stagectl start");
	return code;
}

static int run(struct calibrate *k, struct diag *diag)
{
	int code = prepare(k, diag);

	if (!code)
		code = gather(k, diag);
	if (code)
		return code;
	if (!k->json)
		screen_coverage(&k->observations, k->coverage, k->from_corners ? NULL : k->counts);
	if (stopped) {
		fprintf(stderr,
			"stopped; what was found is in %s: stagectl calibrate cameras "
			"--from it goes on\n",
			k->kept_path);
		return EXIT_CODE_INCOMPLETE;
	}
	code = make(k, diag);
	if (code)
		return code;
	print_result(k);
	return k->making.verdict.passed ? reload(k) : (int)EXIT_CODE_BAD_INPUT;
}

static void finish(struct calibrate *k)
{
	observations_finish(&k->observations);
	calibrate_making_finish(&k->making);
	rig_store_unlock(k->lock_fd, k->rig_dir);
	free(k);
}

int verb_calibrate_cameras(const struct verb *verb, int argc, char **argv)
{
	struct calibrate *k = calloc(1, sizeof(*k));
	struct diag diag = {0};

	if (!k)
		return EXIT_CODE_INTERNAL;
	k->lock_fd = -1;
	k->lens = SOLVE_LENS_DEFAULT;
	k->socket_dir = DEFAULT_SOCKET_DIR;
	const struct argument arguments[] = {
		{"from", "PATH",
		 "a recording's directory or config, or corners.vnl (default: live)",
		 .text = &k->from},
		{"socket-dir", "DIR", "of the station, live (default " DEFAULT_SOCKET_DIR ")",
		 .text = &k->socket_dir},
		{"seconds", "N", "live: solve after so many, even if more is missing",
		 .number = &k->seconds_max},
		{"config", "FILE", "board, limits and rig (default: the station's or recording's)",
		 .text = &k->config_path},
		{"board", "FILE", "describes the board (default: the config's calibration.board)",
		 .text = &k->board_path},
		{"out", "RIG", "the rig that is made (default: the config's)", .text = &k->out},
		{"lens", "MODEL", "as mrcal calls it (default " SOLVE_LENS_DEFAULT ")",
		 .text = &k->lens},
		{"accept-scale", NULL, "all distances may differ from the rig before",
		 .flag = &k->accept_scale},
		{"json", NULL, "print JSON objects: events while live, then the result",
		 .flag = &k->json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);
	int code = parsed == ARGUMENTS_OK ? run(k, &diag) : arguments_exit_code(parsed);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	finish(k);
	return code;
}
