/*
 * This thread takes shots and tells; each shot's pictures are searched by short-lived threads, as
 * many as there are processors. What comes meanwhile is not queued: the next shot is the newest.
 */
#include "ctl/calibrate/calibrate_live.h"

#include <jansson.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "calib/board/choose.h"
#include "calib/board/observations_file.h"
#include "calib/solve/seed.h"
#include "ctl/calibrate/calibrate_guide.h"
#include "ctl/camera/picture_feed.h"
#include "ctl/control_client.h"

#define WAIT_NS (100 * NS_PER_MS)
#define SILENCE_NS (5 * NS_PER_S) /* without a shot: the station is gone */
#define TELL_NS NS_PER_S
#define TELL_PART 10 /* telling takes at most such a part of the time */
#define KEEP_NS (10 * NS_PER_S)
#define SOLVABLE_VIEWS (SEED_VIEWS_MIN + 2) /* some may contradict the others */
#define LONGER 2                            /* when nothing can be solved at the end of the time */

struct live {
	const struct calibration *calibration;
	const struct board *board;
	const struct live_options *options;
	struct picture_feed *feed;
	int hold_fd; /* while it is open the station calibrates; -1: not yet */
	uint32_t camera_count;
	struct view_search searches[CAMERA_MAX];
	/* of the shot that is searched */
	struct fed_shot shot;
	_Atomic uint32_t next_camera;
	_Atomic int err;
	/* told */
	struct guide guide;
	struct observations chosen;
	struct camera_coverage coverage[CAMERA_MAX];
	struct picture_counts counts[CAMERA_MAX];
	int64_t begin_ns, last_shot_ns, next_tell_ns, next_keep_ns;
	uint64_t shots;
	bool enough;   /* all cameras have what they need */
	bool solvable; /* they have what a solution takes at least */
};

int calibrate_live_look(struct live_station *station, const char *socket_dir)
{
	json_t *reply;
	int code = control_ask(&reply, socket_dir, "org.stage.Control.GetStatus", NULL);

	if (code)
		return code;
	const json_t *status = json_object_get(reply, "status");
	const char *state = json_string_value(json_object_get(status, "state"));
	const char *config = json_string_value(json_object_get(status, "config"));

	snprintf(station->state, sizeof(station->state), "%s", state ? state : "?");
	snprintf(station->config_path, sizeof(station->config_path), "%s", config ? config : "");
	json_decref(reply);
	return EXIT_CODE_OK;
}

static int tell_station(const char *socket_dir, const char *method)
{
	json_t *reply;
	int code = control_ask(&reply, socket_dir, method, NULL);

	if (!code)
		json_decref(reply);
	return code;
}

int calibrate_live_reload(const char *socket_dir)
{
	return tell_station(socket_dir, "org.stage.Control.ReloadRig");
}

static void *search_pictures(void *argument)
{
	struct live *live = argument;
	uint32_t c;

	while ((c = atomic_fetch_add(&live->next_camera, 1)) < live->camera_count) {
		if (!(live->shot.has_mask >> c & 1))
			continue;
		int err = view_search_run(&live->searches[c], &live->shot.frames[c]);
		if (err)
			atomic_store(&live->err, err);
	}
	return NULL;
}

/* On this thread too. */
static int search_shot(struct live *live)
{
	long processors = sysconf(_SC_NPROCESSORS_ONLN);
	pthread_t threads[CAMERA_MAX];
	uint32_t count = 0;

	atomic_store(&live->next_camera, 0);
	atomic_store(&live->err, 0);
	while (count + 1 < live->camera_count && (long)count + 1 < processors &&
	       pthread_create(&threads[count], NULL, search_pictures, live) == 0)
		count++;
	search_pictures(live);
	while (count)
		pthread_join(threads[--count], NULL);
	live->shots++;
	return atomic_load(&live->err);
}

static int put_together(struct live *live, struct observations *all)
{
	struct observed_camera cameras[CAMERA_MAX];
	struct view_search *searches[CAMERA_MAX];

	memset(cameras, 0, sizeof(cameras));
	for (uint32_t c = 0; c < live->camera_count; c++) {
		struct fed_camera fed = picture_feed_camera(live->feed, c);

		snprintf(cameras[c].name, sizeof(cameras[c].name), "%s", fed.name);
		cameras[c].width_px = fed.width_px;
		cameras[c].height_px = fed.height_px;
		searches[c] = &live->searches[c];
	}
	int err = observations_init(all, live->board, cameras, live->camera_count, NULL);
	if (!err)
		err = views_put_together(all, searches, live->counts);
	for (uint32_t c = 0; c < live->camera_count; c++)
		live->counts[c].skipped = (uint32_t)picture_feed_skipped(live->feed, c);
	return err;
}

static int find_facts(struct live *live, struct guide_facts *facts)
{
	struct choose_settings settings = CHOOSE_SETTINGS_DEFAULT;
	struct observations all = {0}, chosen;
	uint32_t poses_max = (uint32_t)live->calibration->poses_max;

	settings.poses_max = poses_max;
	int err = put_together(live, &all);
	if (!err)
		err = observations_choose(&chosen, &all, &settings, &facts->near_count);
	observations_finish(&all);
	if (err)
		return err;
	observations_finish(&live->chosen);
	live->chosen = chosen;
	facts->observations = &live->chosen;
	facts->coverage = live->coverage;
	facts->counts = live->counts;
	facts->poses = observations_pose_count(&live->chosen);
	facts->poses_min = (uint32_t)live->calibration->poses_min;
	if (facts->poses_min > poses_max)
		facts->poses_min = poses_max;
	facts->shots = live->shots;
	for (uint32_t c = 0; c < live->camera_count; c++)
		facts->skipped += live->counts[c].skipped;
	return coverage_find(live->coverage, &live->chosen);
}

static bool is_solvable(const struct live *live)
{
	bool alone = live->camera_count == 1, solvable = true;

	for (uint32_t c = 0; c < live->camera_count; c++)
		solvable &= live->coverage[c].views >= SOLVABLE_VIEWS &&
			    (live->coverage[c].linked || alone);
	return solvable;
}

static int keep(const struct live *live)
{
	struct diag diag = {0};
	int err = observations_write(&live->chosen, live->options->kept_path, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err;
}

/* Seldom enough not to cost much, however much there is to look through. */
static int tell(struct live *live)
{
	struct guide_facts facts = {0};
	int64_t now_ns = clock_now_ns();

	if (now_ns < live->next_tell_ns)
		return 0;
	int err = find_facts(live, &facts);
	if (err)
		return err;
	facts.seconds = (double)(now_ns - live->begin_ns) / NS_PER_S;
	guide_show(&live->guide, &facts);
	live->enough |= guide_progress(&facts) >= 1;
	live->solvable = is_solvable(live);
	if (now_ns > live->next_keep_ns) {
		live->next_keep_ns = now_ns + KEEP_NS;
		err = keep(live);
	}
	int64_t took_ns = clock_now_ns() - now_ns;
	live->next_tell_ns =
		clock_now_ns() + (TELL_PART * took_ns > TELL_NS ? TELL_PART * took_ns : TELL_NS);
	return err;
}

/* The operator pressed Enter. */
static bool is_told_enough(void)
{
	struct pollfd input = {.fd = STDIN_FILENO, .events = POLLIN};
	char line[256];

	return isatty(STDIN_FILENO) && poll(&input, 1, 0) > 0 &&
	       read(STDIN_FILENO, line, sizeof(line)) > 0;
}

static bool is_over(const struct live *live)
{
	double seconds = (double)(clock_now_ns() - live->begin_ns) / NS_PER_S;
	double most = live->options->seconds_max;

	return live->enough || is_told_enough() ||
	       (most > 0 && seconds > (live->solvable ? most : LONGER * most));
}

/* Another program stopped the station, or it died. */
static bool is_left(const struct live *live)
{
	struct pollfd hold = {.fd = live->hold_fd, .events = POLLIN};

	return poll(&hold, 1, 0) > 0;
}

static int keep_and_report(struct live *live, const char *what)
{
	struct guide_facts facts = {0};
	int err = find_facts(live, &facts);

	if (!err)
		err = keep(live);
	if (err)
		return EXIT_CODE_INTERNAL;
	fprintf(stderr,
		"stagectl: %s; what was found is in %s; is the station still there? stagectl "
		"status\n",
		what, live->options->kept_path);
	return EXIT_CODE_CONNECTION;
}

static int gather(struct live *live, const volatile sig_atomic_t *stop)
{
	int err = 0;

	guide_begin(&live->guide, live->options->json);
	live->begin_ns = live->last_shot_ns = clock_now_ns();
	live->next_keep_ns = live->begin_ns + KEEP_NS;
	while (!err && !*stop && !is_over(live)) {
		if (picture_feed_next(live->feed, WAIT_NS, &live->shot) == 0) {
			live->last_shot_ns = clock_now_ns();
			err = search_shot(live);
		} else if (is_left(live)) {
			return keep_and_report(live, "the station no longer calibrates");
		} else if (clock_now_ns() - live->last_shot_ns > SILENCE_NS) {
			return keep_and_report(live, "no picture has come for 5 s");
		}
		if (!err)
			err = tell(live);
	}
	if (err)
		fprintf(stderr, "stagectl: the board could not be searched for: %s\n",
			strerror(-err));
	return exit_code_of(err, EXIT_CODE_INTERNAL);
}

static int init_searches(struct live *live)
{
	const struct view_search_settings settings = {live->calibration->blur_max_px, false};
	int err = 0;

	live->camera_count = picture_feed_camera_count(live->feed);
	for (uint32_t c = 0; c < live->camera_count && !err; c++)
		err = view_search_init(&live->searches[c], c, live->board, &settings);
	return exit_code_of(err, EXIT_CODE_INTERNAL);
}

static void finish(struct live *live)
{
	for (uint32_t c = 0; c < live->camera_count; c++)
		view_search_finish(&live->searches[c]);
	observations_finish(&live->chosen);
	picture_feed_close(live->feed);
	if (live->hold_fd >= 0)
		close(live->hold_fd);
	free(live);
}

static int begin(struct live *live, const char *socket_dir)
{
	int code = control_hold(&live->hold_fd, socket_dir, "org.stage.Control.Calibrate");

	if (!code)
		code = picture_feed_open(&live->feed, socket_dir);
	return code ? code : init_searches(live);
}

int calibrate_live(struct observations *observations, struct picture_counts *counts,
		   const struct calibration *calibration, const struct board *board,
		   const struct live_options *options, const volatile sig_atomic_t *stop)
{
	struct live *live = calloc(1, sizeof(*live));
	struct observations all = {0};

	if (!live)
		return EXIT_CODE_INTERNAL;
	live->calibration = calibration;
	live->board = board;
	live->options = options;
	live->hold_fd = -1;
	int code = begin(live, options->socket_dir);
	if (!code)
		code = gather(live, stop);
	int stopped = live->hold_fd >= 0 && !is_left(live)
			      ? tell_station(options->socket_dir, "org.stage.Control.Stop")
			      : 0;
	if (!code)
		code = stopped;
	if (!code)
		code = exit_code_of(put_together(live, &all), EXIT_CODE_INTERNAL);
	if (code) {
		observations_finish(&all);
	} else {
		*observations = all;
		memcpy(counts, live->counts, live->camera_count * sizeof(*counts));
	}
	finish(live);
	return code;
}
