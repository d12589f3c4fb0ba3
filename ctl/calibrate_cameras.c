/*
 * stagectl calibrate cameras: from pictures of a waved board, or the corners kept from them, to a
 * rig in force. Until it has passed, nothing of the rig from before is touched.
 */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "calib/before.h"
#include "calib/choose.h"
#include "calib/observations_file.h"
#include "calib/report.h"
#include "calib/rig_store.h"
#include "calib/rig_write.h"
#include "calib/scale_check.h"
#include "ctl/arguments.h"
#include "ctl/calibrate_read.h"
#include "ctl/calibrate_screen.h"

#ifndef STAGE_VERSION
#error "STAGE_VERSION comes from meson"
#endif

#define CORNERS_NAME "corners.vnl"

struct calibrate {
	const char *from, *config_path, *board_path, *out, *lens;
	bool json, accept_scale, has_config, from_corners;
	struct config config;
	struct board board;
	char rig_dir[PATH_MAX];
	char kept_path[PATH_MAX]; /* the corners, kept */
	struct picture_counts counts[CAMERA_MAX];
	struct observations observations; /* chosen */
	struct camera_coverage coverage[CAMERA_MAX];
	uint32_t near_count;
	struct rig before;
	uint32_t before_number;
	struct seed seed;
	struct solution solution;
	struct volume volume;
	struct uncertainty uncertainty;
	struct cross_check check;
	struct verdict verdict;
	struct camera_move moves[CAMERA_MAX];
	struct pose rt_stage_ref;
	double scale;
	bool scale_changed;
	uint32_t number;
	char revision[17], revision_dir[PATH_MAX];
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
	char path[PATH_MAX];

	if (!k->config_path && k->from_corners) {
		k->config.calibration = calibration_default();
		return 0;
	}
	if (k->config_path)
		snprintf(path, sizeof(path), "%s", k->config_path);
	else if (snprintf(path, sizeof(path), is_dir(k->from) ? "%s/stage.yaml" : "%s", k->from) >=
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
	k->before_number = rig_store_in_force(k->rig_dir);
	return rig_store_path(k->kept_path, k->rig_dir, CORNERS_NAME, true, diag);
}

static void complain_of_camera(const struct calibrate *k, uint32_t c, struct diag *diag)
{
	const struct picture_counts *n = &k->counts[c];
	const char *name = k->observations.cameras[c].name;

	if (n->mirrored && !n->good)
		diag_add(
			diag,
			"camera %s: its pictures are mirrored: no tag can be read, but their "
			"mirror images can; switch off the camera's flip (ReverseX), and take away "
			"any mirror from its path",
			name);
	else if (n->other > n->good)
		diag_add(
			diag,
			"camera %s: %u of %u pictures show another board than %d x %d squares with "
			"tags from %d on; count the squares, and correct calibration.board",
			name, n->other, n->pictures, k->board.squares_x, k->board.squares_y,
			k->board.first_id);
	else if (n->blurred > n->good)
		diag_add(diag,
			 "camera %s: %u of %u views are blurred (%.1f px, at most %.1f px); wave "
			 "slower, light more, or focus the lens",
			 name, n->blurred, n->blurred + n->good, n->blur_px,
			 k->config.calibration.blur_max_px);
}

/* What pictures show and corners do not. Returns 0 or -EINVAL. */
static int check_pictures(const struct calibrate *k, struct diag *diag)
{
	int before = diag->count;

	for (uint32_t c = 0; c < k->observations.camera_count; c++)
		complain_of_camera(k, c, diag);
	if (diag->count > before)
		return -EINVAL;
	for (uint32_t c = 0; c < k->observations.camera_count; c++)
		if (k->counts[c].apart)
			fprintf(stderr,
				"camera %s: %u views were exposed up to %.2f ms apart from the "
				"other "
				"cameras' and link it to none; calibrate with all exposures at one "
				"time\n",
				k->observations.cameras[c].name, k->counts[c].apart,
				k->counts[c].apart_ms);
	return 0;
}

static void no_progress(const struct picture_progress *progress, void *user)
{
	(void)progress;
	(void)user;
}

static int choose(struct calibrate *k, struct observations *all)
{
	struct choose_settings settings = CHOOSE_SETTINGS_DEFAULT;

	settings.poses_max = (uint32_t)k->config.calibration.poses_max;
	int err = observations_choose(&k->observations, all, &settings, &k->near_count);
	if (!err)
		err = coverage_find(k->coverage, &k->observations);
	return err;
}

/* The corners are on the disk when it returns 0. */
static int gather(struct calibrate *k, struct diag *diag)
{
	struct observations all = {0};
	int err;

	if (k->from_corners) {
		err = observations_read(&all, k->from, diag);
	} else {
		on_signals(stop);
		err = calibrate_read(&all, k->counts, &k->config, &k->board, &stopped,
				     isatty(STDERR_FILENO) ? screen_progress : no_progress, NULL,
				     diag);
		on_signals(SIG_DFL);
	}
	if (!err && k->from_corners)
		k->board = all.board;
	if (!err)
		err = choose(k, &all);
	observations_finish(&all);
	if (!err)
		err = observations_write(&k->observations, k->kept_path, diag);
	return err;
}

static int find_before(struct calibrate *k, struct diag *diag)
{
	int err = rig_before(&k->before, k->rig_dir, &k->observations);

	return err ? err : rig_before_check_sizes(&k->before, k->rig_dir, &k->observations, diag);
}

static int solve_all(struct calibrate *k, struct diag *diag)
{
	struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;
	const struct observations *o = &k->observations;

	settings.lens = k->lens;
	int err = seed_make(&k->seed, o, diag);
	if (!err)
		err = solve(&k->solution, o, &k->seed, &settings, diag);
	if (!err)
		err = volume_of_poses(&k->volume, &k->solution, o);
	if (!err)
		err = uncertainty_find(&k->uncertainty, &k->solution, o, &k->volume);
	if (err == -EDOM) {
		diag_add(diag, "no part of the volume is seen by two cameras; wave the board where "
			       "their images overlap");
		return -EINVAL;
	}
	if (!err)
		err = cross_check(&k->check, o, &k->seed, &k->solution, &k->volume, &settings,
				  diag);
	return err;
}

static void judge(struct calibrate *k, struct diag *diag)
{
	struct diag quiet = {0};

	k->verdict = verdict_of(&k->config.calibration.limits, &k->observations, &k->solution,
				&k->uncertainty, &k->check);
	k->rt_stage_ref = rig_before_frame(&k->before, &k->observations, &k->solution, k->moves);
	k->scale = 1;
	k->scale_changed = scale_has_changed(&k->observations, &k->solution, &k->before, &k->scale,
					     k->accept_scale ? &quiet : diag);
	if (k->scale_changed && !k->accept_scale) {
		diag_add(diag, "if this print is the right one, say --accept-scale");
		k->verdict.passed = false;
	}
	diag_finish(&quiet);
}

static int write_report(const struct calibrate *k, const struct rig_facts *rig, struct diag *diag)
{
	char path[PATH_MAX], before[16] = "";

	if (snprintf(path, sizeof(path), "%s/report.html", k->revision_dir) >= PATH_MAX)
		return -ENAMETOOLONG;
	if (k->before_number)
		snprintf(before, sizeof(before), "%04u", k->before_number);
	const struct report_facts facts = {.rig = rig,
					   .revision = k->revision,
					   .coverage = k->coverage,
					   .moves = k->moves,
					   .before = k->before.camera_count && !*before ? "before"
											: before,
					   .scale = k->scale};
	return report_write(path, &facts, diag);
}

static int keep_corners(const struct calibrate *k, struct diag *diag)
{
	char path[PATH_MAX];

	if (snprintf(path, sizeof(path), "%s/" CORNERS_NAME, k->revision_dir) >= PATH_MAX)
		return -ENAMETOOLONG;
	if (!rename(k->kept_path, path))
		return 0;
	int err = -errno;
	diag_add(diag, "%s: cannot write: %s", path, strerror(-err));
	return err;
}

static int write_rig(struct calibrate *k, struct diag *diag)
{
	const struct rig_facts rig = {.software = "stage " STAGE_VERSION,
				      .observations = &k->observations,
				      .solution = &k->solution,
				      .volume = &k->volume,
				      .uncertainty = &k->uncertainty,
				      .cross_check = &k->check,
				      .verdict = &k->verdict,
				      .rt_stage_ref = k->rt_stage_ref};
	uint32_t kept;
	int err = rig_store_next(k->rig_dir, &k->number, diag);

	if (!err)
		err = rig_store_revision_path(k->revision_dir, k->rig_dir, k->number, diag);
	if (!err)
		err = rig_write(k->revision_dir, &rig, k->revision, diag);
	if (!err)
		err = write_report(k, &rig, diag);
	if (!err)
		err = keep_corners(k, diag);
	if (!err && k->verdict.passed)
		err = rig_store_put_in_force(k->rig_dir, k->number, &kept, diag);
	return err;
}

static void print_result(const struct calibrate *k)
{
	if (!k->json) {
		screen_verdict(&k->verdict);
		printf("%s: revision %04u, %s; report: %s/report.html\n", k->rig_dir, k->number,
		       k->verdict.passed ? "in force" : "NOT in force: the rig from before stays",
		       k->revision_dir);
		return;
	}
	json_t *object = json_pack(
		"{s:s, s:i, s:s, s:s, s:b, s:f, s:f, s:f, s:f, s:i, s:i, s:o, s:o}", "rig",
		k->rig_dir, "number", (int)k->number, "dir", k->revision_dir, "revision",
		k->revision, "passed", k->verdict.passed, "rms_px", k->solution.rms_px,
		"held_out_px", k->check.held_out_rms_px, "uncertainty_mm",
		1e3 * k->uncertainty.rms_m, "worst_mm", 1e3 * k->uncertainty.worst_m, "poses",
		(int)k->solution.pose_count, "near_duplicates", (int)k->near_count, "limits",
		screen_verdict_json(&k->verdict), "cameras",
		screen_coverage_json(&k->observations, k->coverage,
				     k->from_corners ? NULL : k->counts));
	json_dumpf(object, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(object);
}

static int prepare(struct calibrate *k, struct diag *diag)
{
	k->from_corners = ends_with(k->from, ".vnl");
	int err = load_config(k, diag);

	if (!err)
		err = find_board(k, diag);
	return err ? err : find_rig(k, diag);
}

static int run(struct calibrate *k, struct diag *diag)
{
	int err = prepare(k, diag);

	if (!err)
		err = gather(k, diag);
	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	if (!k->json)
		screen_coverage(&k->observations, k->coverage, k->from_corners ? NULL : k->counts);
	if (stopped) {
		fprintf(stderr,
			"stopped; what was found is in %s: stagectl calibrate cameras "
			"--from it goes on\n",
			k->kept_path);
		return EXIT_CODE_INCOMPLETE;
	}
	if (!k->from_corners)
		err = check_pictures(k, diag);
	if (!err)
		err = find_before(k, diag);
	if (!err)
		err = solve_all(k, diag);
	if (!err) {
		judge(k, diag);
		err = write_rig(k, diag);
	}
	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	print_result(k);
	return k->verdict.passed ? EXIT_CODE_OK : EXIT_CODE_BAD_INPUT;
}

static void finish(struct calibrate *k)
{
	observations_finish(&k->observations);
	seed_finish(&k->seed);
	solution_finish(&k->solution);
	rig_finish(&k->before);
	free(k);
}

int verb_calibrate_cameras(const struct verb *verb, int argc, char **argv)
{
	struct calibrate *k = calloc(1, sizeof(*k));
	struct diag diag = {0};

	if (!k)
		return EXIT_CODE_INTERNAL;
	k->lens = SOLVE_LENS_DEFAULT;
	const struct argument arguments[] = {
		{"from", "PATH", "a recording's directory or config, or corners.vnl",
		 .text = &k->from},
		{"config", "FILE", "board, limits and rig (default: the recording's own)",
		 .text = &k->config_path},
		{"board", "FILE", "describes the board (default: the config's calibration.board)",
		 .text = &k->board_path},
		{"out", "RIG", "the rig that is made (default: the config's)", .text = &k->out},
		{"lens", "MODEL", "as mrcal calls it (default " SOLVE_LENS_DEFAULT ")",
		 .text = &k->lens},
		{"accept-scale", NULL, "all distances may differ from the rig before",
		 .flag = &k->accept_scale},
		{"json", NULL, "print one JSON object", .flag = &k->json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);
	int code = arguments_exit_code(parsed);

	if (parsed == ARGUMENTS_OK && !k->from) {
		fprintf(stderr, "stagectl: --from is missing: a recording of the board\n");
		code = EXIT_CODE_USAGE;
	} else if (parsed == ARGUMENTS_OK) {
		code = run(k, &diag);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	finish(k);
	return code;
}
