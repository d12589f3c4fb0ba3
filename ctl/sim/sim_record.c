/*
 * stagectl sim record: a simulated recording for files: cameras, with its truth beside it.
 */
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"
#include "sim/record.h"

static void progress(uint64_t shots_done, uint64_t shot_count, void *user)
{
	(void)user;
	fprintf(stderr, "\r%" PRIu64 " of %" PRIu64 " shots%s", shots_done, shot_count,
		shots_done == shot_count ? "\n" : "");
}

static void report(const char *dir, bool json)
{
	char live[PATH_MAX];

	snprintf(live, sizeof(live), "%s/live.yaml", dir);
	bool is_board = access(live, F_OK) != 0; /* which no station tracks */

	if (json)
		print_json(json_pack("{s:s, s:s+, s:s?}", "dir", dir, "config", dir, "/stage.yaml",
				     "live", is_board ? NULL : live));
	else if (is_board)
		printf("%s: written; next: stagectl calibrate cameras --from %s\n", dir, dir);
	else
		printf("%s: written; next: stagectl process %s/stage.yaml, or, the same live, "
		       "staged --config %s\n",
		       dir, dir, live);
}

/* What was asked for was wrong, or it could not be written. */
static int exit_code_of_record(int err)
{
	return err == -EINVAL || err == -EEXIST ? EXIT_CODE_USAGE : EXIT_CODE_INTERNAL;
}

int verb_sim_record(const struct verb *verb, int argc, char **argv)
{
	const char *dir, *scene = "talking", *optics = NULL;
	uint64_t seed = 1, cameras = 0, hd = 0;
	double seconds = 2, rate_hz = 0;
	bool json = false;
	struct diag diag = {0};
	const struct argument arguments[] = {
		{"seconds", "S", "how long (default 2)", .number = &seconds},
		{"scene", "SCENE", "a scene's name or file (default talking)", .text = &scene},
		{"seed", "N", "of face, motion and noise (default 1)", .count = &seed,
		 .count_max = UINT64_MAX},
		{"cameras", "N", "how many IR cameras (default: the scene's own)",
		 .count = &cameras},
		{"hd", "N", "HD cameras beside them, 0 to 3 (default 0)", .count = &hd},
		{"rate", "HZ", "shots per second (default: the scene's own)", .number = &rate_hz},
		{"optics", "NAME", "gaussian or tailed (default: the scene's own)",
		 .text = &optics},
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &dir, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	struct sim_options options = {.scene = scene,
				      .seed = seed,
				      .camera_count = (uint32_t)cameras,
				      .rate_hz = rate_hz,
				      .optics = optics,
				      .hd_camera_count = (uint32_t)hd,
				      .hd_after_ir_ns = SIM_HD_AFTER_IR_NS};
	int err = sim_record(&options, dir, seconds, isatty(STDERR_FILENO) ? progress : NULL, NULL,
			     &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	if (err)
		return exit_code_of_record(err);
	report(dir, json);
	return EXIT_CODE_OK;
}
