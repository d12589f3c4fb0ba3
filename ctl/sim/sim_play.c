/*
 * stagectl sim play: a scene through the tracking code of the station, in this process, and how
 * well that did against the truth.
 */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "config/layout_file.h"
#include "ctl/arguments.h"
#include "ctl/play_report.h"
#include "sim/play.h"

#define PIXEL_SECONDS 2 /* unless asked for: pictures take long */
#define PROGRESS_NS (200 * NS_PER_MS)

struct request {
	const char *scene, *level, *clock, *optics, *layout_path;
	uint64_t seed, cameras;
	double start_s, warm_up_s, seconds, rate_hz, face_speed_m_s;
	bool json;
};

struct playing {
	struct sim_play play;
	struct layout given; /* what the tracker knows instead of the scene's own */
	struct score score;
	uint64_t blobs_lost, markers_lost;
	int64_t elapsed_ns;
};

static const struct blob_play BLOBS = {0}; /* as the scene's optics have it */

static volatile sig_atomic_t stopped;

static void stop(int signal_number)
{
	(void)signal_number;
	stopped = 1;
}

static bool is_one_of(const char *name, const char *value, const char *a, const char *b)
{
	if (strcmp(value, a) == 0 || strcmp(value, b) == 0)
		return true;
	fprintf(stderr, "stagectl: --%s %s: must be %s or %s\n", name, value, a, b);
	return false;
}

static bool is_pixel(const struct request *request)
{
	return strcmp(request->level, "pixel") == 0;
}

static uint64_t shot_at(const struct playing *playing, double time_s)
{
	return (uint64_t)(time_s * sim_scene_script(playing->play.scene)->rate_hz);
}

/* The score goes by the order of the markers: it must be the scene's. */
static int use_layout(struct playing *playing, const char *path, struct diag *diag)
{
	const struct layout *own = sim_scene_layout(playing->play.scene);
	struct layout *given = &playing->given;
	int err = layout_load(given, path, diag);
	bool same = !err && given->marker_count == own->marker_count && own->actor_count == 1;

	for (uint32_t i = 0; same && i < own->marker_count; i++)
		same = strcmp(given->markers[i].name, own->markers[i].name) == 0;
	if (err || same) {
		playing->play.tracker_rig.layout = given;
		if (!err)
			tracker_state_init(&playing->play.state, given);
		return err;
	}
	diag_add(diag, "%s: has other markers than the scene's one actor wears", path);
	return -EINVAL;
}

/* The warm-up is played at blob level and not scored. */
static int begin(struct playing *playing, const struct request *request, struct diag *diag)
{
	struct sim_options options = {.scene = request->scene,
				      .seed = request->seed,
				      .camera_count = (uint32_t)request->cameras,
				      .rate_hz = request->rate_hz,
				      .optics = request->optics,
				      .face_speed_m_s = request->face_speed_m_s};
	int err = sim_play_init(&playing->play, &options, diag);
	uint64_t first = err ? 0 : shot_at(playing, request->start_s);

	if (!err && request->layout_path)
		err = use_layout(playing, request->layout_path, diag);
	if (err)
		return err;
	for (uint64_t n = shot_at(playing, fmax(request->start_s - request->warm_up_s, 0));
	     n < first; n++)
		sim_play_shot_us(&playing->play, &BLOBS, n, 0);
	playing->play.cost = (struct sim_play_cost){0};
	return is_pixel(request) ? sim_play_use_pixels(&playing->play, SIM_NOISE_FULL, diag) : 0;
}

static void show_progress(uint64_t done, uint64_t count, int64_t *shown_ns)
{
	int64_t now_ns = clock_now_ns();

	if (done < count && now_ns - *shown_ns < PROGRESS_NS)
		return;
	*shown_ns = now_ns;
	fprintf(stderr, "\r%" PRIu64 " of %" PRIu64 " shots%s", done, count,
		done == count ? "\n" : "");
}

static void count_lost(struct playing *playing)
{
	const struct sim_play *play = &playing->play;

	for (uint32_t c = 0; c < play->rig.camera_count; c++)
		playing->blobs_lost += play->sets[c].blobs_lost;
	playing->markers_lost += play->set.markers_lost;
}

/* Until the scene's end, the time asked for or an interrupt. */
static void run(struct playing *playing, const struct request *request)
{
	const struct sim_scene *scene = playing->play.scene;
	double own_s = is_pixel(request) ? PIXEL_SECONDS : sim_scene_script(scene)->seconds;
	double seconds = request->seconds > 0 ? request->seconds : own_s;
	uint64_t count = (uint64_t)ceil(seconds * sim_scene_script(scene)->rate_hz);
	uint64_t first = shot_at(playing, request->start_s);
	bool real = strcmp(request->clock, "real") == 0, terminal = isatty(STDERR_FILENO);
	int64_t begin_ns = clock_now_ns(), shown_ns = 0;

	score_init(&playing->score);
	for (uint64_t n = 0; n < count && !stopped; n++) {
		if (real)
			clock_sleep_until(begin_ns + sim_scene_mid_exposure_ns(scene, n));
		sim_play_shot_us(&playing->play, &BLOBS, first + n, 0);
		score_shot(&playing->score, &playing->play.truth, &playing->play.set);
		count_lost(playing);
		if (terminal)
			show_progress(n + 1, count, &shown_ns);
	}
	playing->elapsed_ns = clock_now_ns() - begin_ns;
}

static void report(const struct playing *playing, const struct request *request)
{
	const struct play_report report = {.script = sim_scene_script(playing->play.scene),
					   .score = &playing->score,
					   .cost = &playing->play.cost,
					   .level = request->level,
					   .seed = request->seed,
					   .blobs_lost = playing->blobs_lost,
					   .markers_lost = playing->markers_lost,
					   .elapsed_ns = playing->elapsed_ns};

	if (request->json)
		play_report_print_json(&report);
	else
		play_report_print_table(&report);
}

static int play(const struct request *request)
{
	static struct playing playing; /* large */
	struct diag diag = {0};
	int err = begin(&playing, request, &diag);

	if (!err) {
		signal(SIGINT, stop);
		run(&playing, request);
		report(&playing, request);
	}
	sim_play_finish(&playing.play);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return exit_code_of(err, err == -EINVAL ? EXIT_CODE_BAD_INPUT : EXIT_CODE_INTERNAL);
}

int verb_sim_play(const struct verb *verb, int argc, char **argv)
{
	struct request r = {.level = "blob", .clock = "virtual", .seed = 1};
	const struct argument arguments[] = {
		{"seed", "N", "of face, motion and noise (default 1)", .count = &r.seed,
		 .count_max = UINT64_MAX},
		{"seconds", "S", "how long (default: the scene's own, 2 with pixels)",
		 .number = &r.seconds},
		{"start", "S", "from which second on (default 0)", .number = &r.start_s},
		{"warm-up", "S", "of blobs before the start, not scored (default 0)",
		 .number = &r.warm_up_s},
		{"face-speed", "V",
		 "peak of the fastest marker, in m/s beside the head's motion (default: the "
		 "scene's own)",
		 .number = &r.face_speed_m_s},
		{"level", "LEVEL", "blob (default) or pixel", .text = &r.level},
		{"layout", "FILE",
		 "what the tracker knows of the markers: a calibrated actor (default: the scene's "
		 "own)",
		 .text = &r.layout_path},
		{"optics", "NAME", "gaussian or tailed (default: the scene's own)",
		 .text = &r.optics},
		{"clock", "CLOCK", "virtual, as fast as it goes (default), or real",
		 .text = &r.clock},
		{"cameras", "N", "how many IR cameras (default: the scene's own)",
		 .count = &r.cameras},
		{"rate", "HZ", "shots per second (default: the scene's own)", .number = &r.rate_hz},
		ARGUMENT_JSON(&r.json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &r.scene, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (!is_one_of("level", r.level, "blob", "pixel") ||
	    !is_one_of("clock", r.clock, "virtual", "real"))
		return EXIT_CODE_USAGE;
	return play(&r);
}
