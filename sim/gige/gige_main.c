/*
 * stage-sim-gige: serves a simulated scene as GigE Vision cameras on loopback until it is told to
 * end. Prints one line when the cameras answer, and one with its counts at the end.
 */
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/gige/gige.h"
#include "sim/gige/gige_loopback.h"
#include "sim/gige/gige_losses.h"

enum { EXIT_USAGE = 2 };

struct arguments {
	struct sim_options scene;
	int64_t epoch_ns;
	const char *first_address;
	double lost_ratio;
	struct gige_abilities abilities;
	bool die_with_parent;
};

static const char usage[] =
	"usage: stage-sim-gige [options]\n"
	"  --scene NAME          one of stagectl sim list, or a file; default talking\n"
	"  --seed N              of face, motion and noise; default 1\n"
	"  --cameras N           4 to 24; default: the scene's own\n"
	"  --rate HZ             default: the scene's own\n"
	"  --epoch-ns NS         scene time 0 on CLOCK_MONOTONIC; default: now\n"
	"  --first-address IP    of camera 0, the others follow; default 127.0.0.11\n"
	"  --lost-packets RATIO  share of packets lost on the way; default 0\n"
	"  --resend              lost packets are sent again to who asks for them\n"
	"  --ptp NS              cameras can follow PTP, whose master is NS from CLOCK_TAI\n"
	"  --die-with-parent     end when the program that started this one does\n";

static const struct option options[] = {
	{"scene", required_argument, NULL, 's'},
	{"seed", required_argument, NULL, 'd'},
	{"cameras", required_argument, NULL, 'c'},
	{"rate", required_argument, NULL, 'r'},
	{"epoch-ns", required_argument, NULL, 'e'},
	{"first-address", required_argument, NULL, 'a'},
	{"lost-packets", required_argument, NULL, 'l'},
	{"ptp", required_argument, NULL, 't'},
	{"resend", no_argument, NULL, 'n'},
	{"die-with-parent", no_argument, NULL, 'p'},
	{"help", no_argument, NULL, 'h'},
	{NULL, 0, NULL, 0},
};

/* A whole number from `low` to `high`, or the program ends with a message. */
static int64_t parse_integer(const char *name, const char *text, int64_t low, int64_t high)
{
	char *end;

	errno = 0;
	int64_t value = strtoll(text, &end, 10);

	if (errno || end == text || *end || value < low || value > high) {
		fprintf(stderr,
			"stage-sim-gige: --%s '%s': not a whole number from %" PRId64 " to %" PRId64
			"\n",
			name, text, low, high);
		exit(EXIT_USAGE);
	}
	return value;
}

static double parse_number(const char *name, const char *text, double low, double high)
{
	char *end;
	double value = strtod(text, &end);

	if (end == text || *end || !(value >= low && value <= high)) {
		fprintf(stderr, "stage-sim-gige: --%s '%s': not a number from %g to %g\n", name,
			text, low, high);
		exit(EXIT_USAGE);
	}
	return value;
}

static void parse_arguments(struct arguments *a, int argc, char **argv)
{
	for (int c; (c = getopt_long(argc, argv, "", options, NULL)) != -1;) {
		switch (c) {
		case 's':
			a->scene.scene = optarg;
			break;
		case 'd':
			a->scene.seed = (uint64_t)parse_integer("seed", optarg, 0, INT64_MAX);
			break;
		case 'c':
			a->scene.camera_count =
				(uint32_t)parse_integer("cameras", optarg, 1, CAMERA_MAX);
			break;
		case 'r':
			a->scene.rate_hz = parse_number("rate", optarg, 1, 1000);
			break;
		case 'e':
			a->epoch_ns = parse_integer("epoch-ns", optarg, 0, INT64_MAX);
			break;
		case 'a':
			a->first_address = optarg;
			break;
		case 'l':
			a->lost_ratio = parse_number("lost-packets", optarg, 0, 1);
			break;
		case 'n':
			a->abilities.resend = true;
			break;
		case 't':
			a->abilities.ptp = true;
			a->abilities.master_ahead_ns =
				parse_integer("ptp", optarg, -INT64_MAX / 2, INT64_MAX / 2);
			break;
		case 'p':
			a->die_with_parent = true;
			break;
		default:
			fputs(usage, c == 'h' ? stdout : stderr);
			exit(c == 'h' ? EXIT_SUCCESS : EXIT_USAGE);
		}
	}
	if (optind < argc) {
		fprintf(stderr, "stage-sim-gige: unexpected '%s'\n%s", argv[optind], usage);
		exit(EXIT_USAGE);
	}
}

/* Serves until SIGTERM or SIGINT, which are blocked in every thread and awaited here. */
static void serve(struct gige_stage *stage, const struct sim_scene *scene,
		  const struct arguments *a, const sigset_t *ending)
{
	int width_px, height_px, signal_number;

	gige_stage_image_size(stage, &width_px, &height_px);
	printf("ready cameras=%" PRIu32
	       " first_address=%s width_px=%d height_px=%d period_ns=%" PRId64 " epoch_ns=%" PRId64
	       "\n",
	       sim_scene_camera_count(scene), a->first_address, width_px, height_px,
	       sim_scene_period_ns(scene), a->epoch_ns);
	fflush(stdout);
	sigwait(ending, &signal_number);
	gige_stage_stop(stage);
	struct gige_counts counts = gige_stage_counts(stage);

	printf("ended frames_sent=%" PRIu64 " frames_late=%" PRIu64 " shots_skipped=%" PRIu64 "\n",
	       counts.sent, counts.late, counts.skipped);
}

static void watch(void *user, int control_fd, int64_t packet_ns)
{
	gige_stage_latch(user, control_fd, packet_ns);
}

static int run(const struct arguments *a, const sigset_t *ending, struct diag *diag)
{
	struct sim_scene *scene = NULL;
	struct gige_stage *stage = NULL;
	int error = sim_scene_create(&scene, &a->scene, diag);

	if (!error) {
		gige_loopback_offer(a->first_address, sim_scene_camera_count(scene));
		error = gige_stage_create(&stage, scene, a->epoch_ns, a->first_address, diag);
	}
	if (!error) {
		gige_loopback_watch(watch, stage);
		error = gige_losses_begin(a->lost_ratio, a->abilities.resend);
	}
	if (!error)
		error = gige_stage_start(stage, &a->abilities, diag);
	if (!error)
		serve(stage, scene, a, ending);
	gige_stage_destroy(stage);
	gige_losses_end();
	sim_scene_destroy(scene);
	return error;
}

int main(int argc, char **argv)
{
	struct arguments a = {.scene = {.seed = 1}, .first_address = "127.0.0.11"};
	struct diag diag = {0};
	sigset_t ending;

	parse_arguments(&a, argc, argv);
	if (!a.epoch_ns)
		a.epoch_ns = clock_now_ns();
	sigemptyset(&ending);
	sigaddset(&ending, SIGTERM);
	sigaddset(&ending, SIGINT);
	sigprocmask(SIG_BLOCK, &ending, NULL);
	if (a.die_with_parent)
		prctl(PR_SET_PDEATHSIG, SIGTERM);
	prctl(PR_SET_TIMERSLACK, 1UL); /* pulses on time, for this thread and those it starts */
	int error = run(&a, &ending, &diag);

	if (error && !diag.count)
		diag_add(&diag, "stage-sim-gige: %s", strerror(-error));
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return error ? EXIT_FAILURE : EXIT_SUCCESS;
}
