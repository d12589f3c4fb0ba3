/*
 * stagectl stream tap: subscribes as any solver does, through libstage, and prints every shot.
 */
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "protocol/stage_client.h"

struct tap {
	struct stage_client *client;
	const struct stage_description *description;
	bool json;
	uint64_t count_wanted; /* 0 = no limit */
	double seconds;        /* 0 = no limit */
	uint64_t count;
	bool unnamed; /* told, and still so */
};

static const char *status_name(int32_t status)
{
	static const char *const names[] = {"missing", "predicted", "two_camera", "measured"};

	return status >= 0 && status < 4 ? names[status] : "unknown";
}

/* JSON has no word for what is not finite. */
static json_t *numbers_json(const double *values, int count)
{
	json_t *array = json_array();

	for (int i = 0; i < count; i++) {
		if (!isfinite(values[i])) {
			json_decref(array);
			return json_null();
		}
		json_array_append_new(array, json_real(values[i]));
	}
	return array;
}

/* As `stagectl process` writes them; what is not known is left out. */
static void add_layers(json_t *json, const struct stage_marker *marker)
{
	double stabilised_m[3], normalised_m[3];

	for (int i = 0; i < 3; i++) {
		stabilised_m[i] = marker->stabilised_m[i];
		normalised_m[i] = marker->normalised_m[i];
	}
	if (isfinite(stabilised_m[0]))
		json_object_set_new(json, "stabilised_m", numbers_json(stabilised_m, 3));
	if (isfinite(normalised_m[0]))
		json_object_set_new(json, "normalised_m", numbers_json(normalised_m, 3));
	if (marker->label >= 0)
		json_object_set_new(json, "confidence", json_real((double)marker->confidence));
	if (marker->gone)
		json_object_set_new(json, "gone", json_true());
	if (marker->ghost)
		json_object_set_new(json, "ghost", json_true());
}

static json_t *marker_json(const struct tap *tap, const struct stage_marker *marker)
{
	const struct stage_description *description = tap->description;
	bool named = description && marker->label >= 0 &&
		     (uint32_t)marker->label < description->label_count;
	double cov_m2[6];

	for (int i = 0; i < 6; i++)
		cov_m2[i] = marker->cov_m2[i];
	json_t *json = json_pack("{s:s?, s:o, s:o, s:f, s:i, s:s}", "label",
				 named ? description->labels[marker->label].name : NULL, "p_m",
				 numbers_json(marker->p_m, 3), "cov_m2", numbers_json(cov_m2, 6),
				 "residual_px", (double)marker->residual_px, "cameras",
				 (int)marker->camera_count, "status", status_name(marker->status));
	if (named && description->actor_count > 1)
		json_object_set_new(
			json, "actor",
			json_string(description->actors[description->labels[marker->label].actor]));
	add_layers(json, marker);
	return json;
}

static json_t *head_json(const struct tap *tap, const struct stage_head *head)
{
	const struct stage_description *description = tap->description;
	bool named = description && head->actor < description->actor_count;

	json_t *json = json_pack("{s:s?, s:o, s:o, s:f}", "actor",
				 named ? description->actors[head->actor] : NULL, "q",
				 numbers_json(head->q_wxyz, 4), "t_m", numbers_json(head->t_m, 3),
				 "residual_m", head->residual_m);
	if (head->jig_slip)
		json_object_set_new(json, "jig_slip_m", json_real(head->slip_m));
	return json;
}

static json_t *missing_json(const struct tap *tap, uint32_t mask)
{
	json_t *missing = json_array();

	for (uint32_t c = 0; tap->description && c < tap->description->camera_count; c++)
		if (mask >> c & 1)
			json_array_append_new(missing,
					      json_string(tap->description->cameras[c].name));
	return missing;
}

static void print_json(const struct tap *tap, const struct stage_marker_set *set)
{
	json_t *markers = json_array(), *heads = json_array();

	for (uint32_t m = 0; m < set->marker_count; m++)
		json_array_append_new(markers, marker_json(tap, &set->markers[m]));
	for (uint32_t h = 0; h < set->head_count; h++)
		json_array_append_new(heads, head_json(tap, &set->heads[h]));
	json_t *object = json_pack(
		"{s:I, s:I, s:o, s:o, s:o, s:I, s:I, s:I, s:I}", "shot", (json_int_t)set->shot,
		"mid_exposure_ns", (json_int_t)set->mid_exposure_ns, "markers", markers, "heads",
		heads, "missing_cameras", missing_json(tap, set->missing_mask), "arrival_ns",
		(json_int_t)set->arrival_ns, "solved_ns", (json_int_t)set->solved_ns, "sent_ns",
		(json_int_t)set->sent_ns, "sets_lost", (json_int_t)set->sets_lost);
	if (set->is_hd)
		json_object_set_new(object, "hd",
				    json_pack("{s:I, s:i, s:I}", "index", (json_int_t)set->hd_index,
					      "phase", (int)set->hd_phase, "mid_exposure_ns",
					      (json_int_t)set->hd_mid_exposure_ns));
	json_dumpf(object, stdout, JSON_COMPACT | JSON_REAL_PRECISION(9));
	putchar('\n');
	json_decref(object);
}

static void print_line(const struct stage_marker_set *set)
{
	uint32_t by_status[4] = {0}, unnamed = 0;
	double latency_ms = (double)(clock_now_ns() - set->arrival_ns) / NS_PER_MS;

	for (uint32_t m = 0; m < set->marker_count; m++) {
		const struct stage_marker *marker = &set->markers[m];

		if (marker->label < 0)
			unnamed++;
		else if (marker->status >= 0 && marker->status < 4)
			by_status[marker->status]++;
	}
	printf("shot %8" PRIu64 "  measured %3u  two-camera %3u  predicted %3u  missing %3u  "
	       "unnamed %3u  cameras missing %d  head %s  %6.2f ms",
	       set->shot, by_status[STAGE_MEASURED], by_status[STAGE_TWO_CAMERA],
	       by_status[STAGE_PREDICTED], by_status[STAGE_MISSING], unnamed,
	       __builtin_popcount(set->missing_mask), set->head_count ? "yes" : "no ",
	       set->arrival_ns > 0 ? latency_ms : 0.0);
	if (set->is_hd)
		printf("  hd %" PRIu64, set->hd_index);
	if (set->sets_lost)
		printf("  lost so far %" PRIu64, set->sets_lost);
	putchar('\n');
}

static void print_description(const struct stage_description *description)
{
	printf("station %s, rig %s, %u cameras, %u labels, %s, %s-handed, %s\n",
	       description->station_version, description->rig_revision, description->camera_count,
	       description->label_count, description->length_unit, description->handedness,
	       description->stage_axes);
}

/* Beside the shots, for whoever wonders that none of their markers has a name. */
static void tell_unnamed(struct tap *tap, const struct stage_unnamed *unnamed)
{
	if (unnamed && !tap->unnamed)
		fprintf(stderr,
			"no names for %.0f s: cameras see %.0f spots a picture, of which %.1f "
			"points and %.1f markers a shot are made: %s\n",
			unnamed->seconds, unnamed->spots, unnamed->points, unnamed->named,
			unnamed->remedy);
	tap->unnamed = unnamed;
}

static void take_event(struct tap *tap, const struct stage_event *event)
{
	if (event->kind == STAGE_DESCRIPTION) {
		tap->description = event->description;
		if (!tap->json)
			print_description(event->description);
	} else if (event->kind == STAGE_MARKERS) {
		if (tap->json)
			print_json(tap, event->markers);
		else
			print_line(event->markers);
		fflush(stdout);
		tap->count++;
	} else if (event->kind == STAGE_NOTICE) {
		fprintf(stderr, "the station says: %s\n", event->notice->text);
	} else if (event->kind == STAGE_STATISTICS) {
		tell_unnamed(tap, event->statistics->unnamed);
	}
}

/* Returns 0 at a limit or a negative errno. */
static int listen_to(struct tap *tap)
{
	int64_t end_ns = clock_now_ns() + (int64_t)(tap->seconds * (double)NS_PER_S);

	while (!tap->count_wanted || tap->count < tap->count_wanted) {
		int64_t left_ms = (end_ns - clock_now_ns()) / NS_PER_MS;
		struct stage_event event;

		if (tap->seconds > 0 && left_ms <= 0)
			return 0;
		int timeout_ms = tap->seconds > 0 && left_ms < 1000 ? (int)left_ms : 1000;
		int err = stage_client_next(tap->client, timeout_ms, &event);
		if (err && err != -ETIMEDOUT)
			return err;
		if (!err)
			take_event(tap, &event);
		if (ferror(stdout))
			return -EPIPE;
	}
	return 0;
}

static int run(struct tap *tap, const char *socket_dir)
{
	char path[PATH_MAX];

	snprintf(path, sizeof(path), "%s/stream.sock", socket_dir);
	int err = stage_client_open(&tap->client, path);
	if (err) {
		fprintf(stderr,
			"stagectl: %s: no station streams here: %s; is staged running, with this "
			"--socket-dir?\n",
			path, strerror(-err));
		return EXIT_CODE_CONNECTION;
	}
	err = listen_to(tap);
	stage_client_close(tap->client);
	if (err == -EPIPE)
		return EXIT_CODE_OK; /* whoever read the output has seen enough */
	if (err) {
		fprintf(stderr, "stagectl: %s: %s\n", path,
			err == -ENODATA ? "the station ended the stream" : strerror(-err));
		return EXIT_CODE_CONNECTION;
	}
	bool complete = tap->count_wanted ? tap->count == tap->count_wanted : tap->count > 0;
	return complete ? EXIT_CODE_OK : EXIT_CODE_INCOMPLETE;
}

int verb_stream_tap(const struct verb *verb, int argc, char **argv)
{
	const char *socket_dir = DEFAULT_SOCKET_DIR;
	struct tap tap = {0};
	const struct argument arguments[] = {
		{"count", "N", "stop after N shots (default 0: never)", .count = &tap.count_wanted},
		{"seconds", "S", "stop after S seconds", .number = &tap.seconds},
		ARGUMENT_SOCKET_DIR(&socket_dir),
		{"json", NULL, "print one JSON object per shot", .flag = &tap.json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	return parsed == ARGUMENTS_OK ? run(&tap, socket_dir) : arguments_exit_code(parsed);
}
