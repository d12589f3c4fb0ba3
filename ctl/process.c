/*
 * stagectl process: the tracking of the live station over recordings, nothing dropped, one JSON
 * object per shot. The same files give the same bytes.
 */
#include <inttypes.h>
#include <jansson.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "base/output_file.h"
#include "ctl/arguments.h"
#include "ctl/replay.h"
#include "ctl/rig_fit.h"
#include "ctl/shot_json.h"
#include "ctl/take_ends.h"
#include "ctl/take_names.h"

struct process {
	struct replay *replay;
	struct take_ends *ends;
	struct rig_fit *fit;
	struct take_names names;
	struct output_file output;
	int64_t begin_ns, progress_ns;
	bool show_progress, json;
};

static void progress(struct process *p)
{
	int64_t now_ns = clock_now_ns();
	uint64_t shots = replay_count(p->replay).shots;

	if (!p->show_progress || now_ns < p->progress_ns)
		return;
	p->progress_ns = now_ns + NS_PER_S / 4;
	fprintf(stderr, "\r%" PRIu64 " shots, %.1f per second ", shots,
		(double)shots * NS_PER_S / (double)(now_ns - p->begin_ns + 1));
}

static void print_summary(const struct process *p)
{
	struct replay_count count = replay_count(p->replay);

	fprintf(stderr,
		"%s%" PRIu64 " shots in %.1f s, %" PRIu64 " incomplete, %" PRIu64
		" images of shots already closed\n",
		p->show_progress ? "\r" : "", count.shots,
		(double)(clock_now_ns() - p->begin_ns) / NS_PER_S, count.incomplete, count.stale);
	take_names_print(&p->names, stderr);
	rig_fit_print(p->fit, stderr);
}

/* Standard output is for the shots. */
static void print_summary_json(const struct process *p)
{
	struct replay_count count = replay_count(p->replay);
	json_t *object = json_pack("{s:I, s:I, s:I, s:o, s:o}", "shots", (json_int_t)count.shots,
				   "incomplete", (json_int_t)count.incomplete, "stale",
				   (json_int_t)count.stale, "rig", rig_fit_json(p->fit), "unnamed",
				   take_names_json(&p->names));

	json_dumpf(object, stderr, JSON_COMPACT);
	fputc('\n', stderr);
	json_decref(object);
}

static int run(struct process *p, struct diag *diag)
{
	const struct layout *layout = &replay_stage(p->replay)->layout;
	const struct marker_set *set;

	p->begin_ns = clock_now_ns();
	p->show_progress = isatty(STDERR_FILENO) && !p->json;
	/* a full disk ends it: commit says so */
	while (!ferror(p->output.stream) && (set = replay_next(p->replay))) {
		shot_json_write(p->output.stream, set, layout);
		take_ends_step(p->ends, set);
		rig_fit_step(p->fit, replay_shot(p->replay), set);
		take_names_step(&p->names, replay_shot(p->replay), set);
		progress(p);
	}
	if (output_file_commit(&p->output, diag) < 0)
		return EXIT_CODE_INTERNAL;
	replay_report(p->replay, diag);
	take_ends_print(p->ends, stderr);
	if (p->json)
		print_summary_json(p);
	else
		print_summary(p);
	return diag->count ? EXIT_CODE_BAD_INPUT : EXIT_CODE_OK;
}

static int prepare(struct process *p, const char *config_path, const char *output_path,
		   uint64_t threads, struct diag *diag)
{
	int code = replay_open(&p->replay, config_path, NULL, threads, diag);

	if (code != EXIT_CODE_OK)
		return code;
	if (output_file_open(&p->output, output_path, diag) < 0)
		return EXIT_CODE_INTERNAL;
	p->ends = take_ends_create(&replay_stage(p->replay)->layout);
	p->fit = rig_fit_create(replay_stage(p->replay));
	p->names.stage = replay_stage(p->replay);
	return p->ends && p->fit ? EXIT_CODE_OK : EXIT_CODE_INTERNAL;
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
		{"json", NULL, "the last line on standard error is one JSON object", .flag = &json},
		{0},
	};
	enum arguments_result parsed =
		arguments_parse(verb, arguments, argc, argv, &config_path, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	struct process process = {.json = json};
	int code = prepare(&process, config_path, output_path, threads, &diag);
	if (code == EXIT_CODE_OK)
		code = run(&process, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	output_file_discard(&process.output);
	take_ends_destroy(process.ends);
	rig_fit_destroy(process.fit);
	replay_close(process.replay);
	return code;
}
