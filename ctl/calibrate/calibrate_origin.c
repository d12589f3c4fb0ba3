/*
 * stagectl calibrate origin: the stage frame by a board on the floor or an L-frame of markers.
 */
#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/exit_codes.h"
#include "calib/rig/origin.h"
#include "calib/rig/rig_move.h"
#include "ctl/arguments.h"
#include "ctl/calibrate/calibrate_read.h"
#include "ctl/control_client.h"
#include "ctl/marker_feed.h"

#ifndef STAGE_VERSION
#error "STAGE_VERSION comes from meson"
#endif

#define SECONDS_DEFAULT 2

struct origin_verb {
	struct marker_feed_source source;
	const char *board_path;
	uint64_t long_mm, short_mm; /* 0: by the board */
	bool json;
	struct marker_feed *feed; /* its stage; shots with an L-frame alone */
	struct origin origin;
	struct rig_moved moved;
};

static struct pose pose_now(const char *name, const struct pose *rt_cam_stage, const void *user)
{
	const struct origin_verb *verb = user;
	struct pose rt_stage_new = pose_inverse(&verb->origin.rt_new_stage);

	(void)name;
	return pose_compose(rt_cam_stage, &rt_stage_new);
}

static void no_progress(const struct picture_progress *progress, void *user)
{
	(void)progress;
	(void)user;
}

static int by_board(struct origin_verb *verb, struct diag *diag)
{
	static const volatile sig_atomic_t never;
	struct picture_counts *counts = calloc(CAMERA_MAX, sizeof(*counts));
	const struct config *config = &verb->feed->stage.config;
	struct board board = config->calibration.board;
	struct observations observations;
	int err = counts ? 0 : -ENOMEM;

	if (!err && verb->board_path)
		err = board_load(&board, verb->board_path, diag);
	if (!err && !verb->board_path && !config->calibration.has_board) {
		diag_add(
			diag,
			"%s: calibration.board: missing; describe the board there, or give --board "
			"FILE",
			config->path);
		err = -EINVAL;
	}
	if (!err)
		err = calibrate_read(&observations, counts, config, &board, &never, no_progress,
				     NULL, diag);
	if (!err) {
		err = origin_of_board(&verb->origin, &verb->feed->stage.rig, &observations, diag);
		observations_finish(&observations);
	}
	free(counts);
	return err;
}

static int write_rig(struct origin_verb *verb, struct diag *diag)
{
	const struct stage *stage = &verb->feed->stage;
	struct rig_move move = {.what = "origin",
				.software = "stage " STAGE_VERSION,
				.names = (const char(*)[NAME_BYTES])stage->rig.names,
				.count = stage->rig.camera_count,
				.pose = pose_now,
				.user = verb};

	snprintf(move.details, sizeof(move.details), "stage_frame: %s\norigin_off_mm: %.3f\n",
		 verb->long_mm ? "L-frame" : "board", verb->origin.off_mm);
	return rig_move(&verb->moved, stage->config.rig_dir, &move, diag);
}

static void print_result(const struct origin_verb *verb)
{
	const struct stage *stage = &verb->feed->stage;
	const struct pose rt_stage_new = pose_inverse(&verb->origin.rt_new_stage);

	if (!verb->json) {
		printf("%s: revision %04u (%s), in force; origin by the %s, %u points, %.2f mm off "
		       "it\n",
		       stage->config.rig_dir, verb->moved.number, verb->moved.revision,
		       verb->long_mm ? "L-frame" : "board", verb->origin.point_count,
		       verb->origin.off_mm);
		return;
	}
	json_t *object =
		json_pack("{s:s, s:i, s:s, s:i, s:f, s:[f, f, f]}", "rig", stage->config.rig_dir,
			  "number", (int)verb->moved.number, "revision", verb->moved.revision,
			  "points", (int)verb->origin.point_count, "off_mm", verb->origin.off_mm,
			  "origin_before_m", rt_stage_new.t.x, rt_stage_new.t.y, rt_stage_new.t.z);
	json_dumpf(object, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(object);
}

static int find_origin(struct origin_verb *verb, struct diag *diag)
{
	if (!verb->long_mm)
		return by_board(verb, diag);
	return origin_of_l_frame(&verb->origin, &verb->feed->stage.rig, &verb->feed->shots,
				 1e-3 * (double)verb->long_mm, 1e-3 * (double)verb->short_mm, diag);
}

static int run(struct origin_verb *verb, struct diag *diag)
{
	int code = verb->long_mm ? marker_feed_open(&verb->feed, &verb->source, diag)
				 : marker_feed_open_rig(&verb->feed, verb->source.from, diag);

	if (code != EXIT_CODE_OK)
		return code;
	int err = find_origin(verb, diag);
	if (!err)
		err = write_rig(verb, diag);
	if (err)
		return err == -EBUSY ? EXIT_CODE_RUNNING
				     : (int)exit_code_of(err, EXIT_CODE_BAD_INPUT);
	if (!verb->source.from) {
		json_t *reply;

		code = control_ask(&reply, verb->source.socket_dir, "org.stage.Control.ReloadRig",
				   NULL);
		if (code == EXIT_CODE_OK)
			json_decref(reply);
	}
	print_result(verb);
	return code;
}

/* Returns EXIT_CODE_USAGE with a message when they do not go together. */
static int check_arguments(const struct origin_verb *verb)
{
	if (!verb->long_mm != !verb->short_mm) {
		fputs("stagectl: an L-frame has --long-arm-mm and --short-arm-mm\n", stderr);
		return EXIT_CODE_USAGE;
	}
	if (!verb->long_mm && !verb->source.from) {
		fputs("stagectl: --from is missing: a recording of the board on the floor; or give "
		      "the arms of an L-frame\n",
		      stderr);
		return EXIT_CODE_USAGE;
	}
	return EXIT_CODE_OK;
}

int verb_calibrate_origin(const struct verb *verb, int argc, char **argv)
{
	struct origin_verb origin = {
		.source = {.socket_dir = DEFAULT_SOCKET_DIR, .for_new_rig = true}};
	struct diag diag = {0};
	uint64_t seconds = SECONDS_DEFAULT;
	const struct argument arguments[] = {
		{"from", "PATH",
		 "a recording's directory or config (an L-frame: default the station)",
		 .text = &origin.source.from},
		{"board", "FILE", "describes the board (default: the config's calibration.board)",
		 .text = &origin.board_path},
		{"long-arm-mm", "N",
		 "of an L-frame, along x: from the corner's marker to the end's",
		 .count = &origin.long_mm},
		{"short-arm-mm", "N", "of an L-frame, along y", .count = &origin.short_mm},
		ARGUMENT_SOCKET_DIR(&origin.source.socket_dir),
		{"seconds", "N", "of the station's markers (default 2)", .count = &seconds},
		ARGUMENT_JSON(&origin.json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	origin.source.seconds = (double)seconds;
	int code = check_arguments(&origin);
	if (code == EXIT_CODE_OK)
		code = run(&origin, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	marker_feed_close(origin.feed);
	return code;
}
