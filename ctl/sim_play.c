/*
 * stagectl sim play: a scene through the tracking code of the station, in this process, and how
 * well that did against the truth.
 */
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "sim/play.h"

#define PIXEL_SECONDS 2 /* unless asked for: pictures take long */
#define PROGRESS_NS (200 * NS_PER_MS)

struct request {
	const char *scene, *level, *clock, *optics;
	uint64_t seed, cameras;
	double seconds, rate_hz;
	bool json;
};

struct playing {
	struct sim_play play;
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

static int begin(struct playing *playing, const struct request *request, struct diag *diag)
{
	struct sim_options options = {.scene = request->scene,
				      .seed = request->seed,
				      .camera_count = request->cameras > UINT32_MAX
							      ? UINT32_MAX
							      : (uint32_t)request->cameras,
				      .rate_hz = request->rate_hz,
				      .optics = request->optics};
	int err = sim_play_init(&playing->play, &options, diag);

	if (!err && is_pixel(request))
		err = sim_play_use_pixels(&playing->play, SIM_NOISE_FULL, diag);
	return err;
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

/* Until the scene's end, or an interrupt. */
static void run(struct playing *playing, const struct request *request)
{
	const struct sim_scene *scene = playing->play.scene;
	double own_s = is_pixel(request) ? PIXEL_SECONDS : sim_scene_script(scene)->seconds;
	double seconds = request->seconds > 0 ? request->seconds : own_s;
	uint64_t count = (uint64_t)ceil(seconds * sim_scene_script(scene)->rate_hz);
	bool real = strcmp(request->clock, "real") == 0, terminal = isatty(STDERR_FILENO);
	int64_t begin_ns = clock_now_ns(), shown_ns = 0;

	score_init(&playing->score);
	for (uint64_t n = 0; n < count && !stopped; n++) {
		if (real)
			clock_sleep_until(begin_ns + sim_scene_mid_exposure_ns(scene, n));
		sim_play_shot_us(&playing->play, &BLOBS, n, 0);
		score_shot(&playing->score, &playing->play.truth, &playing->play.set);
		count_lost(playing);
		if (terminal)
			show_progress(n + 1, count, &shown_ns);
	}
	playing->elapsed_ns = clock_now_ns() - begin_ns;
}

/* Of nothing it is 0. */
static double share(double part, uint64_t whole)
{
	return whole ? part / (double)whole : 0;
}

/* Scene time over this thread's CPU time. */
static double speed(const struct playing *playing)
{
	const struct sim_play_cost *cost = &playing->play.cost;
	double rate_hz = sim_scene_script(playing->play.scene)->rate_hz;
	double cpu_s = (cost->truth_us + cost->blobs_us + cost->tracker_us) * 1e-6;

	return cpu_s > 0 ? (double)playing->score.shots / rate_hz / cpu_s : 0;
}

static json_t *cost_json(const struct playing *playing)
{
	const struct sim_play_cost *cost = &playing->play.cost;
	uint64_t shots = playing->score.shots;

	return json_pack("{s:f, s:f, s:f}", "truth", share(cost->truth_us, shots), "blobs",
			 share(cost->blobs_us, shots), "tracker", share(cost->tracker_us, shots));
}

static void print_json(const struct playing *playing, const struct request *request)
{
	const struct sim_script *script = sim_scene_script(playing->play.scene);
	const struct score *s = &playing->score;
	json_t *object = json_pack(
		"{s:s, s:s, s:I, s:s, s:I, s:I, s:f, s:f, s:I, s:f, s:f, s:I, s:f, s:I, s:I, s:f, "
		"s:o}",
		"scene", script->name, "level", request->level, "seed", (json_int_t)request->seed,
		"optics", script->optics == SIM_OPTICS_TAILED ? "tailed" : "gaussian", "shots",
		(json_int_t)s->shots, "seen_by_three", (json_int_t)s->seen3, "right_share",
		share((double)s->right, s->seen3), "unnamed_share",
		share((double)s->unnamed, s->seen3), "wrong", (json_int_t)s->wrong, "rms_mm",
		1e3 * sqrt(share(s->error2_m2, s->measured)), "nees_per_axis",
		share(s->nees, s->measured) / 3, "stray", (json_int_t)s->stray, "head_rms_mm",
		1e3 * sqrt(share(s->head_error2_m2, s->heads)), "blobs_lost",
		(json_int_t)playing->blobs_lost, "markers_lost", (json_int_t)playing->markers_lost,
		"speed", speed(playing), "cpu_us_per_shot", cost_json(playing));

	json_dumpf(object, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(object);
}

static void print_table(const struct playing *playing)
{
	const struct sim_script *script = sim_scene_script(playing->play.scene);
	const struct sim_play_cost *cost = &playing->play.cost;
	const struct score *s = &playing->score;

	printf("%s: %s\n", script->name, script->title);
	printf("%-9s %" PRIu64 " in %.1f s, %.1f x real time on one core\n", "shots", s->shots,
	       (double)playing->elapsed_ns / NS_PER_S, speed(playing));
	printf("%-9s %.3f %% of %" PRIu64 " seen by three cameras or more\n", "right",
	       100 * share((double)s->right, s->seen3), s->seen3);
	printf("%-9s %.3f %%\n", "unnamed", 100 * share((double)s->unnamed, s->seen3));
	printf("%-9s %" PRIu64 "\n", "wrong", s->wrong);
	printf("%-9s %.4f mm, NEES / 3 = %.2f\n", "rms",
	       1e3 * sqrt(share(s->error2_m2, s->measured)), share(s->nees, s->measured) / 3);
	printf("%-9s %" PRIu64 " blobs, %" PRIu64 " markers\n", "lost", playing->blobs_lost,
	       playing->markers_lost);
	printf("%-9s truth %.0f, blobs %.0f, tracker %.0f us of CPU time a shot\n", "cost",
	       share(cost->truth_us, s->shots), share(cost->blobs_us, s->shots),
	       share(cost->tracker_us, s->shots));
}

static int play(const struct request *request)
{
	static struct playing playing; /* large */
	struct diag diag = {0};
	int err = begin(&playing, request, &diag);

	if (!err) {
		signal(SIGINT, stop);
		run(&playing, request);
		if (request->json)
			print_json(&playing, request);
		else
			print_table(&playing);
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
		{"seed", "N", "of face, motion and noise (default 1)", .count = &r.seed},
		{"seconds", "S", "how long (default: the scene's own, 2 with pixels)",
		 .number = &r.seconds},
		{"level", "LEVEL", "blob (default) or pixel", .text = &r.level},
		{"optics", "NAME", "gaussian or tailed (default: the scene's own)",
		 .text = &r.optics},
		{"clock", "CLOCK", "virtual, as fast as it goes (default), or real",
		 .text = &r.clock},
		{"cameras", "N", "how many IR cameras (default: the scene's own)",
		 .count = &r.cameras},
		{"rate", "HZ", "shots per second (default: the scene's own)", .number = &r.rate_hz},
		{"json", NULL, "print one JSON object", .flag = &r.json},
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
