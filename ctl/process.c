/*
 * stagectl process: the tracking of the live station over recordings, nothing dropped, one JSON
 * object per shot. The same files give the same bytes.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/output_file.h"
#include "ctl/program_drivers.h"
#include "ctl/recording.h"
#include "ctl/shot_json.h"
#include "drivers/files.h"
#include "track/shot.h"
#include "track/sync.h"

struct process {
	struct stage stage;
	struct open_camera cameras[CAMERA_MAX];
	struct recording *recording;
	struct output_file output;
	struct sync sync;
	struct tracker_state tracker;
	struct tracker_scratch *scratch;
	struct marker_set set;
	uint64_t shots, incomplete, stale;
	int64_t begin_ns, progress_ns;
	bool show_progress;
};

static void progress(struct process *p)
{
	int64_t now_ns = clock_now_ns();

	if (!p->show_progress || now_ns < p->progress_ns)
		return;
	p->progress_ns = now_ns + NS_PER_S / 4;
	fprintf(stderr, "\r%" PRIu64 " shots, %.1f per second ", p->shots,
		(double)p->shots * NS_PER_S / (double)(now_ns - p->begin_ns + 1));
}

static void track_shot(struct process *p, const struct sync_decision *decision,
		       const struct blob_set *const *sets)
{
	struct shot shot;

	shot_gather(&shot, decision, sets, p->stage.config.camera_count, p->stage.ir_mask);
	tracker_run(&p->tracker, p->scratch, &p->stage.tracking, &shot, &p->set);
	shot_json_write(p->output.stream, &p->set, &p->stage.layout);
	p->shots++;
	p->incomplete += shot.missing_mask != 0;
	progress(p);
}

/* Every camera has shown its front or has ended, so sync never needs to wait. */
static bool next_shot(struct process *p)
{
	uint32_t camera_count = p->stage.config.camera_count;
	const struct blob_set *sets[CAMERA_MAX];
	struct front fronts[CAMERA_MAX];
	struct sync_decision decision;

	for (uint32_t c = 0; c < camera_count; c++) {
		sets[c] = recording_peek(p->recording, c);
		fronts[c] = front_of_queue(sets[c], true);
	}
	enum sync_result result = sync_next(&p->sync, fronts, camera_count, NULL, false, &decision);
	if (result == SYNC_SHOT)
		track_shot(p, &decision, sets);
	for (uint32_t c = 0; c < camera_count; c++)
		if ((decision.member_mask | decision.stale_mask) >> c & 1)
			recording_pop(p->recording, c);
	p->stale += (uint64_t)__builtin_popcount(decision.stale_mask);
	return result != SYNC_END;
}

/* Opens everything; returns an exit code. */
static int prepare(struct process *p, const char *config_path, const char *output_path,
		   uint64_t threads, struct diag *diag)
{
	int err = stage_load(&p->stage, config_path, diag);

	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	if (!p->stage.ir_mask) {
		diag_add(diag, "%s: cameras: none has the role ir, so there is nothing to track",
			 config_path);
		return EXIT_CODE_BAD_INPUT;
	}
	err = open_cameras(p->cameras, &p->stage, p->stage.ir_mask, recording_drivers, diag);
	if (err)
		return err == -ENOMEM ? EXIT_CODE_INTERNAL : EXIT_CODE_BAD_INPUT;
	if (tracker_scratch_create(&p->scratch) < 0) {
		diag_add(diag, "out of memory");
		return EXIT_CODE_INTERNAL;
	}
	if (output_file_open(&p->output, output_path, diag) < 0)
		return EXIT_CODE_INTERNAL;
	p->sync.period_ns = open_cameras_period_ns(p->cameras, p->stage.ir_mask);
	tracker_state_init(&p->tracker, &p->stage.layout);
	err = recording_open(&p->recording, &p->stage, p->cameras, (uint32_t)threads, diag);
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

static const char *first_problem(const struct open_camera *camera)
{
	const char *problem = files_camera_problem(camera->camera);

	return problem[0] ? problem : "an image of another size than the first";
}

static void report_camera(const struct process *p, uint32_t camera, struct diag *diag)
{
	const struct config_camera *named = &p->stage.config.cameras[camera];
	struct recording_losses losses = recording_losses(p->recording, camera);

	if (losses.damaged)
		diag_add(diag,
			 "camera %s: %" PRIu64 " of %" PRIu64 " images are damaged, and the camera "
			 "is missing from their shots; the first: %s",
			 named->name, losses.damaged, losses.damaged + losses.frames,
			 first_problem(&p->cameras[camera]));
	if (losses.error)
		diag_add(diag, "camera %s: %s: reading ended early: %s", named->name,
			 named->address, strerror(-losses.error));
	if (losses.blobs_lost)
		fprintf(stderr,
			"camera %s: %" PRIu64 " spots beyond %d in an image were left out\n",
			named->name, losses.blobs_lost, BLOB_MAX);
}

static int run(struct process *p, struct diag *diag)
{
	p->begin_ns = clock_now_ns();
	p->show_progress = isatty(STDERR_FILENO);
	while (next_shot(p))
		if (ferror(p->output.stream))
			break; /* a full disk: commit says so */
	if (output_file_commit(&p->output, diag) < 0)
		return EXIT_CODE_INTERNAL;
	for (uint32_t c = 0; c < p->stage.config.camera_count; c++)
		report_camera(p, c, diag);
	fprintf(stderr,
		"%s%" PRIu64 " shots in %.1f s, %" PRIu64 " incomplete, %" PRIu64
		" images of shots already closed\n",
		p->show_progress ? "\r" : "", p->shots,
		(double)(clock_now_ns() - p->begin_ns) / NS_PER_S, p->incomplete, p->stale);
	return diag->count ? EXIT_CODE_BAD_INPUT : EXIT_CODE_OK;
}

static void finish(struct process *p)
{
	output_file_discard(&p->output);
	recording_close(p->recording);
	close_cameras(p->cameras, p->stage.config.camera_count);
	tracker_scratch_destroy(p->scratch);
	stage_finish(&p->stage);
	free(p);
}

int verb_process(const struct verb *verb, int argc, char **argv)
{
	const char *config_path, *output_path = NULL;
	uint64_t threads = (uint64_t)sysconf(_SC_NPROCESSORS_ONLN);
	bool json = false;
	struct diag diag = {0};
	const struct argument arguments[] = {
		{"output", "FILE", "write here, whole or not at all (default: standard output)",
		 .text = &output_path},
		{"threads", "N", "images read at once (default: one per processor)",
		 .count = &threads},
		{"json", NULL, "accepted; the output is always JSON", .flag = &json},
		{0},
	};
	enum arguments_result parsed =
		arguments_parse(verb, arguments, argc, argv, &config_path, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	struct process *process = calloc(1, sizeof(*process));
	if (!process)
		return EXIT_CODE_INTERNAL;
	int code = prepare(process, config_path, output_path, threads, &diag);
	if (code == EXIT_CODE_OK)
		code = run(process, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	finish(process);
	return code;
}
