/*
 * stagectl status: how the running station is doing.
 */
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/control_client.h"

#define CLEAR_SCREEN "\033[H\033[J"

static const char *text_of(const json_t *object, const char *key)
{
	const char *text = json_string_value(json_object_get(object, key));

	return text ? text : "?";
}

static int64_t count_of(const json_t *object, const char *key)
{
	return json_integer_value(json_object_get(object, key));
}

static double number_of(const json_t *object, const char *key)
{
	return json_number_value(json_object_get(object, key));
}

static void print_losses(const json_t *losses)
{
	const char *cause;
	json_t *value;
	bool any = false;

	json_object_foreach((json_t *)losses, cause, value)
	{
		if (json_integer_value(value) == 0)
			continue;
		printf("%s%s %" PRId64, any ? ", " : "", cause, (int64_t)json_integer_value(value));
		any = true;
	}
	puts(any ? "" : "-");
}

/* What to do stands beside what is wrong. */
static void print_moved(const json_t *ledger)
{
	if (!json_is_true(json_object_get(ledger, "moved")))
		return;
	printf("%13smoved: its picture is off by ", "");
	if (number_of(ledger, "moved_mrad") > 0)
		printf("%.2f px (%.2f mrad); stagectl calibrate refine puts it right\n",
		       number_of(ledger, "moved_px"), number_of(ledger, "moved_mrad"));
	else
		printf("pixels; stagectl calibrate refine, or calibrate cameras where that "
		       "refuses\n");
}

static void print_ledger(const json_t *ledger)
{
	static const struct {
		const char *key, *words;
	} states[] = {
		{"slower_than_trigger", "slower than its trigger"},
		{"out_of_step", "out of step"},
		{"dark", "dark"},
		{"overexposed", "overexposed"},
		{"moved", "moved"},
	};
	const char *last = json_string_value(json_object_get(ledger, "last_event"));

	if (!last)
		return;
	printf("%13spulse ledger: last %s in shot %" PRId64, "", last,
	       count_of(ledger, "last_event_shot"));
	for (size_t i = 0; i < sizeof(states) / sizeof(*states); i++)
		if (json_is_true(json_object_get(ledger, states[i].key)))
			printf(", %s", states[i].words);
	printf("; ");
	print_losses(json_object_get(ledger, "events"));
	print_moved(ledger);
}

/* NULL for an IR camera. */
static void print_hd(const json_t *hd)
{
	if (json_is_integer(json_object_get(hd, "shot")))
		printf("%13snewest: HD frame %" PRId64 " of shot %" PRId64 ", phase %" PRId64
		       ", off phase %" PRId64 "\n",
		       "", count_of(hd, "index"), count_of(hd, "shot"), count_of(hd, "phase"),
		       count_of(hd, "off_phase"));
}

static void print_lost(const json_t *lost)
{
	if (json_is_object(lost))
		printf("%13slost for %.0f s: %s\n", "", number_of(lost, "since_s"),
		       text_of(lost, "why"));
}

/* Those that are less than what the config asks for. */
static void print_facts(const json_t *camera)
{
	size_t index;
	json_t *name;

	json_array_foreach(json_object_get(camera, "facts_short"), index,
			   name) if (json_is_string(name))
		printf("%13s%s: %s\n", "", json_string_value(name),
		       text_of(json_object_get(camera, "facts"), json_string_value(name)));
}

static void print_cameras(const json_t *cameras)
{
	size_t index;
	json_t *camera;

	printf("\n%-12s %-4s %-8s %11s %7s %7s %9s %8s  %s\n", "camera", "role", "state", "size",
	       "frame/s", "spots", "frames", "missing", "losses");
	json_array_foreach((json_t *)cameras, index, camera)
	{
		char size[24];

		snprintf(size, sizeof(size), "%" PRId64 "x%" PRId64, count_of(camera, "width_px"),
			 count_of(camera, "height_px"));
		printf("%-12s %-4s %-8s %11s %7.1f %7.1f %9" PRId64 " %8" PRId64 "  ",
		       text_of(camera, "name"), text_of(camera, "role"), text_of(camera, "state"),
		       size, number_of(camera, "frames_per_s"),
		       number_of(camera, "blobs_per_frame"), count_of(camera, "frames"),
		       count_of(camera, "missing"));
		print_losses(json_object_get(camera, "losses"));
		print_ledger(json_object_get(camera, "ledger"));
		print_lost(json_object_get(camera, "lost"));
		print_hd(json_object_get(camera, "hd"));
		print_facts(camera);
	}
}

static void print_subscribers(const json_t *stream)
{
	json_t *subscribers = json_object_get(stream, "subscribers");
	size_t index;
	json_t *one;

	printf("\n%-12s %11s %9s %9s   (%" PRId64 " came, %" PRId64 " cut off, %" PRId64
	       " sets lost)\n",
	       "subscriber", "connected s", "sets", "lost", count_of(stream, "accepted"),
	       count_of(stream, "cut_off"), count_of(stream, "sets_lost"));
	json_array_foreach(subscribers, index, one)
		printf("pid %-8" PRId64 " %11.1f %9" PRId64 " %9" PRId64 "\n", count_of(one, "pid"),
		       number_of(one, "connected_s"), count_of(one, "sets_queued"),
		       count_of(one, "sets_lost"));
}

static void print_stalled(const json_t *stalled)
{
	size_t index;
	json_t *one;

	json_array_foreach((json_t *)stalled, index, one) if (json_is_string(one))
		puts(json_string_value(one));
}

/* Nothing while what the cameras see has names. */
static void print_unnamed(const json_t *unnamed)
{
	if (json_is_object(unnamed))
		printf("no names for %.0f s: cameras see %.0f spots a picture, of which %.1f "
		       "points "
		       "and %.1f of %" PRId64 " markers a shot are made: %s\n",
		       number_of(unnamed, "seconds"), number_of(unnamed, "spots"),
		       number_of(unnamed, "points"), number_of(unnamed, "named"),
		       count_of(unnamed, "markers"), text_of(unnamed, "remedy"));
}

static void print_queue(const char *name, const json_t *queue)
{
	printf("queue %s: %" PRId64 " of %" PRId64 ", at most %" PRId64 " so far\n", name,
	       count_of(queue, "filled"), count_of(queue, "capacity"),
	       count_of(queue, "filled_max"));
}

static void print_percentiles(const json_t *of)
{
	if (!count_of(of, "count"))
		printf(" %8s %8s %8s %8s", "-", "-", "-", "-");
	else
		printf(" %8.2f %8.2f %8.2f %8.2f", number_of(of, "p50_ms"), number_of(of, "p90_ms"),
		       number_of(of, "p99_ms"), number_of(of, "max_ms"));
}

static void print_latencies(const json_t *latencies)
{
	size_t index;
	json_t *one;

	printf("\n%-18s %35s   %35s\n%-18s", "latency, ms", "last 10 to 20 s", "since the start",
	       "");
	for (int i = 0; i < 2; i++)
		printf(" %8s %8s %8s %8s%s", "p50", "p90", "p99", "max", i ? "\n" : "  ");
	json_array_foreach((json_t *)latencies, index, one)
	{
		printf("%-18s", text_of(one, "stage"));
		print_percentiles(json_object_get(one, "recent"));
		printf("  ");
		print_percentiles(json_object_get(one, "run"));
		putchar('\n');
	}
}

/* Nothing when no trigger reports any. */
static void print_pulses(const json_t *pulses)
{
	const json_t *late = json_object_get(pulses, "lateness");

	if (!json_is_object(pulses))
		return;
	if (json_is_string(json_object_get(pulses, "lost_why")))
		printf("trigger lost for %.0f s, and looked for: %s\n",
		       number_of(pulses, "lost_for_s"), text_of(pulses, "lost_why"));
	if (count_of(pulses, "quiet_s") > 2)
		printf("trigger: no pulse for %" PRId64 " s\n", count_of(pulses, "quiet_s"));
	printf("pulses late by %.0f us (p50), %.0f us (p99), %.0f us (max); missed %" PRId64,
	       1e3 * number_of(late, "p50_ms"), 1e3 * number_of(late, "p99_ms"),
	       1e3 * number_of(late, "max_ms"), count_of(pulses, "missed"));
	if (count_of(pulses, "missed"))
		printf(", last shot %" PRId64, count_of(pulses, "last_missed_shot"));
	if (count_of(pulses, "reopened"))
		printf("; back %" PRId64 " times", count_of(pulses, "reopened"));
	printf("; ");
	print_losses(json_object_get(pulses, "events"));
}

static void print_status(const json_t *status)
{
	const json_t *shots = json_object_get(status, "shots");

	printf("%s for %.0f s, %s\n", text_of(status, "state"), number_of(status, "uptime_s"),
	       text_of(status, "config"));
	if (count_of(status, "rig_number"))
		printf("rig revision %04" PRId64 ", ", count_of(status, "rig_number"));
	printf("rig %s, trigger %s", text_of(status, "rig_revision"), text_of(status, "trigger"));
	if (count_of(status, "run")) /* before the first start nobody asked for them */
		printf(", SCHED_FIFO %sgranted, memory %slocked",
		       json_is_true(json_object_get(status, "fifo")) ? "" : "not ",
		       json_is_true(json_object_get(status, "memory_locked")) ? "" : "not ");
	putchar('\n');
	print_pulses(json_object_get(status, "pulses"));
	printf("shots %" PRId64 " (%.1f/s), incomplete %" PRId64 ", lost %" PRId64 "\n",
	       count_of(shots, "solved"), number_of(shots, "per_s"), count_of(shots, "incomplete"),
	       count_of(shots, "lost"));
	if (count_of(shots, "edges_refused"))
		printf("trigger to solver: %" PRId64 " pulses found the queue full\n",
		       count_of(shots, "edges_refused"));
	print_queue("trigger to solver", json_object_get(shots, "edges_queue"));
	print_queue("solver to stream", json_object_get(shots, "sets_queue"));
	print_latencies(json_object_get(status, "latency"));
	if (count_of(status, "sim_late"))
		printf("the simulator itself was late with %" PRId64 " frames\n",
		       count_of(status, "sim_late"));
	print_stalled(json_object_get(status, "stalled"));
	print_unnamed(json_object_get(status, "unnamed"));
	print_cameras(json_object_get(status, "cameras"));
	print_subscribers(json_object_get(status, "stream"));
}

struct view {
	bool json, follow;
};

static bool show(const json_t *parameters, void *user)
{
	const struct view *view = user;
	const json_t *status = json_object_get(parameters, "status");

	if (view->json) {
		json_dumpf(status, stdout, JSON_COMPACT);
		putchar('\n');
	} else {
		if (view->follow && isatty(STDOUT_FILENO))
			fputs(CLEAR_SCREEN, stdout);
		print_status(status);
		if (view->follow)
			putchar('\n');
	}
	fflush(stdout);
	return !ferror(stdout);
}

int verb_status(const struct verb *verb, int argc, char **argv)
{
	const char *socket_dir = DEFAULT_SOCKET_DIR;
	struct view view = {0};
	const struct argument arguments[] = {
		ARGUMENT_SOCKET_DIR(&socket_dir),
		{"follow", NULL, "again every second, until interrupted", .flag = &view.follow},
		{"json", NULL, "print one JSON object, or one a line", .flag = &view.json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (view.follow)
		return control_follow(socket_dir, "org.stage.Control.GetStatus", show, &view);
	json_t *reply;
	int code = control_ask(&reply, socket_dir, "org.stage.Control.GetStatus", NULL);
	if (code)
		return code;
	show(reply, &view);
	json_decref(reply);
	return EXIT_CODE_OK;
}
