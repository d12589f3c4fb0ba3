/*
 * stage-demo: puts up a simulated stage, starts a station on it, subscribes to the stream like any
 * solver, and judges what comes against the truth.
 */
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "demo/align.h"
#include "demo/show.h"
#include "demo/stand.h"

#define EXIT_NOT_STARTED 3
#define EXIT_INTERRUPTED 130
/* Until a station that lives listens, and until its first set: it takes a second on an idle
 * machine, and twenty beside five others at work. */
#define STATION_PATIENCE_NS (60 * NS_PER_S)
#define GRACE_NS (250 * NS_PER_MS) /* a shot may be this old before it counts as lost */
#define TABLE_EVERY_NS NS_PER_S
#define LINE_EVERY_NS (5 * NS_PER_S)

static volatile sig_atomic_t interrupted;

static void on_signal(int number)
{
	(void)number;
	interrupted = true;
}

/* Without SA_RESTART: waiting for the stream ends at once. */
static void catch_signals(void)
{
	struct sigaction action = {.sa_handler = on_signal};

	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGHUP, &action, NULL);
}

struct demo {
	struct demo_options options;
	struct stand stand;
	struct stage_client *client;
	struct referee referee;
	struct demo_facts facts;
	struct calibration_report calibration;
	struct align align;
	struct stress stress;
	bool with_table;
	int64_t start_ns;     /* of the program */
	int64_t first_set_ns; /* received; 0 = none yet */
	int64_t end_ns;       /* of judging */
	int64_t next_show_ns;
};

static void say(const struct demo *demo, const char *words)
{
	fprintf(stderr, "%5.1f s: %s\n", (double)(clock_now_ns() - demo->start_ns) / 1e9, words);
}

/* Until the station listens, or is gone, or takes too long. */
static int subscribe(struct demo *demo, struct diag *diag)
{
	int64_t deadline_ns = clock_now_ns() + STATION_PATIENCE_NS;
	int r;

	while ((r = stage_client_open(&demo->client, demo->stand.socket_path)) < 0) {
		if (interrupted)
			return -EINTR;
		if (!child_is_running(&demo->stand.station))
			return -ECHILD;
		if (clock_now_ns() > deadline_ns) {
			diag_add(diag, "%s: the station does not listen: %s",
				 demo->stand.socket_path, strerror(-r));
			return r;
		}
		clock_sleep_until(clock_now_ns() + 20 * NS_PER_MS);
	}
	return 0;
}

static int calibrate(struct demo *demo, struct diag *diag)
{
	say(demo, "the station has no rig: a board is waved before its cameras");
	int r = demo_calibrate(&demo->calibration, &demo->stand, &interrupted, diag);

	if (r == 0)
		say(demo, "the station runs with the rig that was made");
	return r;
}

static int start(struct demo *demo, struct diag *diag)
{
	int r = stand_init(&demo->stand, &demo->options, diag);

	if (r < 0)
		return r;
	referee_init(&demo->referee, demo->stand.scene, demo->stand.epoch_ns);
	demo->facts.camera_count = demo->stand.camera_count;
	demo->facts.hd_camera_count = demo->stand.hd_count;
	demo->facts.rate_hz = demo->stand.rate_hz;
	if (!demo->options.sim)
		say(demo, "starting the GigE Vision cameras");
	r = stand_start_cameras(&demo->stand, &demo->options, diag, &interrupted);
	if (r < 0)
		return r;
	say(demo, "starting the station");
	r = stand_start_station(&demo->stand, demo->options.calibrate, diag);
	if (r == 0 && demo->options.calibrate)
		r = calibrate(demo, diag);
	return r < 0 ? r : subscribe(demo, diag);
}

static void show_progress(struct demo *demo, int64_t now_ns)
{
	if (now_ns < demo->next_show_ns)
		return;
	demo->next_show_ns = now_ns + (demo->with_table ? TABLE_EVERY_NS : LINE_EVERY_NS);
	struct results results = referee_results(&demo->referee, now_ns - GRACE_NS);
	demo->facts.seconds = (double)(now_ns - demo->first_set_ns) / 1e9;
	if (demo->with_table)
		show_table(stdout, &demo->referee, &results, &demo->facts);
	else
		show_line(stderr, &demo->referee, &results, &demo->facts);
}

static void take_set(struct demo *demo, const struct stage_marker_set *set)
{
	int64_t now_ns = clock_now_ns();

	if (demo->options.calibrate && !demo->align.done) {
		align_take(&demo->align, &demo->referee, set);
		return;
	}
	if (!demo->first_set_ns) {
		say(demo, "the first marker set is here");
		demo->first_set_ns = now_ns;
		demo->next_show_ns = now_ns + NS_PER_S;
		if (demo->options.stress)
			stress_begin(&demo->stress, &demo->stand, demo->options.seconds);
	}
	demo->facts.hd_shots += set->is_hd;
	referee_judge(&demo->referee, set, now_ns);
	if (demo->options.stress)
		stress_see_set(&demo->stress, set);
}

static int take_event(struct demo *demo, const struct stage_event *event, struct diag *diag)
{
	if (event->kind == STAGE_MARKERS)
		take_set(demo, event->markers);
	if (event->kind == STAGE_NOTICE)
		say(demo, event->notice->text);
	if (event->kind == STAGE_DESCRIPTION &&
	    referee_describe(&demo->referee, event->description) < 0) {
		diag_add(diag, "the station's labels are not those of the scene");
		return -EINVAL;
	}
	return 0;
}

static bool time_is_up(const struct demo *demo)
{
	int64_t judged_ns = clock_now_ns() - demo->first_set_ns;

	return demo->first_set_ns && (double)judged_ns >= demo->options.seconds * 1e9;
}

/* Without a set for so long, none will come. */
static int check_patience(const struct demo *demo, int64_t waiting_since_ns, struct diag *diag)
{
	if (demo->first_set_ns || clock_now_ns() - waiting_since_ns < STATION_PATIENCE_NS)
		return 0;
	diag_add(diag, "the station sent no marker set");
	return -ETIMEDOUT;
}

/* Judges the stream until the time is up. */
static int watch(struct demo *demo, struct diag *diag)
{
	int64_t since_ns = clock_now_ns();
	struct stage_event event;
	int r = 0;

	while (r == 0 && !time_is_up(demo)) {
		if (interrupted)
			return -EINTR;
		int next = stage_client_next(demo->client, 100, &event);
		if (next == 0)
			r = take_event(demo, &event, diag);
		else if (next != -ETIMEDOUT && next != -EINTR) {
			diag_add(diag, "the stream ended: %s",
				 next == -ENODATA ? "the station closed it" : strerror(-next));
			r = next;
		} else
			r = check_patience(demo, since_ns, diag);
		if (demo->first_set_ns && demo->options.stress)
			stress_step(&demo->stress, clock_now_ns());
		if (demo->first_set_ns)
			show_progress(demo, clock_now_ns());
	}
	return r;
}

/* A child's end shows a little after its sockets have closed. */
static void explain_children(struct demo *demo, struct diag *diag)
{
	struct child *children[] = {&demo->stand.cameras, &demo->stand.station};

	clock_sleep_until(clock_now_ns() + NS_PER_S / 2);
	for (int i = 0; i < 2; i++)
		if (children[i]->name && !child_is_running(children[i]))
			child_explain(children[i], diag);
}

static int conclude(struct demo *demo)
{
	int64_t first_label_ns = demo->referee.first_label_ns;
	struct results results = referee_results(&demo->referee, demo->end_ns - GRACE_NS);

	demo->facts.seconds = (double)(demo->end_ns - demo->first_set_ns) / 1e9;
	demo->facts.startup_s =
		first_label_ns ? (double)(first_label_ns - demo->start_ns) / 1e9 : NAN;
	if (demo->options.json)
		show_json(stdout, &demo->referee, &results, &demo->facts);
	else
		show_summary(stdout, &demo->referee, &results, &demo->facts);
	return demo_has_passed(&demo->referee, &results, &demo->facts) ? EXIT_SUCCESS
								       : EXIT_FAILURE;
}

static int run(struct demo *demo, struct diag *diag)
{
	int r = start(demo, diag);

	if (r == 0)
		r = watch(demo, diag);
	if (r < 0 && r != -EINTR)
		explain_children(demo, diag);
	demo->end_ns = clock_now_ns();
	if (r == 0 && demo->options.stress)
		stress_finish(&demo->stress);
	stress_stop(&demo->stress);
	if (r == 0)
		report_ask(&demo->facts.station, demo->stand.dir);
	stand_stop(&demo->stand);
	if (r == -EINTR)
		return EXIT_INTERRUPTED;
	if (r < 0 && !demo->first_set_ns)
		return EXIT_NOT_STARTED;
	demo->facts.ended_early = r < 0;
	demo->facts.cameras_counted = stand_camera_counts(&demo->stand, &demo->facts.cameras);
	return conclude(demo);
}

int main(int argc, char **argv)
{
	static struct demo demo;
	struct diag diag = {0};

	demo.options = demo_options_parse(argc, argv);
	demo.start_ns = clock_now_ns();
	demo.with_table = !demo.options.json && isatty(STDOUT_FILENO);
	demo.facts = (struct demo_facts){.mode = demo.options.sim ? "sim" : "gige",
					 .scene = demo.options.scene,
					 .seed = demo.options.seed,
					 .stress = demo.options.stress ? &demo.stress : NULL,
					 .calibration =
						 demo.options.calibrate ? &demo.calibration : NULL};
	catch_signals();
	int status = run(&demo, &diag);
	stage_client_close(demo.client);
	stand_finish(&demo.stand);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return status;
}
