/*
 * getopt_long with checked numbers.
 */
#include "demo/options.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>

#define EXIT_USAGE 2
#define STRESS_SECONDS_MIN 15
#define HD_MAX 3

static const char usage[] =
	"usage: ./stage demo [options]\n"
	"Starts a station on simulated cameras, subscribes to its stream like any solver, "
	"compares\n"
	"what comes with the truth, and ends with a summary.\n"
	"  --seconds N    how long to judge the stream; default 20\n"
	"  --sim          8 cameras at 120 Hz and 3 HD cameras at 30 Hz inside the station; "
	"default:\n"
	"                 4 GigE Vision cameras at 60 Hz over loopback\n"
	"  --stress       with --sim, under fire: CPU hogs, a subscriber that stops, one that is\n"
	"                 killed, a camera unplugged, garbage clients; 15 s at least, default 60\n"
	"  --calibrate    with --sim, and without a rig: a virtual board is waved, the rig is "
	"solved\n"
	"                 from it, and the actor is tracked with it; needs two minutes or three\n"
	"  --hd N         with --sim: as many HD cameras, 0 to 3\n"
	"  --json         print the summary as one JSON object\n"
	"  --scene NAME   one of stagectl sim list; default talking\n"
	"  --seed N       of face, motion and noise; default 1\n"
	"  --keep DIR     keep rig, layout, config and logs there\n"
	"Exit status: 0 passed; 1 median error above 0.1 mm, fewer than 98 % right labels, or "
	"more\n"
	"than 1 % of the shots lost, or --stress found a fault, or --calibrate came to more than\n"
	"0.15 mm rms, rigidly aligned; 2 wrong usage; 3 something could not be started.\n";

static const struct option long_options[] = {
	{"seconds", required_argument, NULL, 's'},
	{"sim", no_argument, NULL, 'i'},
	{"json", no_argument, NULL, 'j'},
	{"scene", required_argument, NULL, 'c'},
	{"seed", required_argument, NULL, 'd'},
	{"keep", required_argument, NULL, 'k'},
	{"stress", no_argument, NULL, 'x'},
	{"hd", required_argument, NULL, 'n'},
	{"calibrate", no_argument, NULL, 'b'},
	{"help", no_argument, NULL, 'h'},
	{NULL, 0, NULL, 0},
};

static void end_wrong_usage(const char *option, const char *text, const char *expected)
{
	fprintf(stderr, "stage-demo: %s '%s': not %s\n", option, text, expected);
	exit(EXIT_USAGE);
}

static double parse_seconds(const char *text)
{
	char *end;
	double seconds = strtod(text, &end);

	if (end == text || *end || !(seconds >= 1 && seconds <= 86400))
		end_wrong_usage("--seconds", text, "a number from 1 to 86400");
	return seconds;
}

static uint64_t parse_seed(const char *text)
{
	char *end;

	errno = 0;
	long long seed = strtoll(text, &end, 10);
	if (end == text || *end || errno || seed < 0)
		end_wrong_usage("--seed", text, "a whole number from 0 on");
	return (uint64_t)seed;
}

static uint32_t parse_hd(const char *text)
{
	if (text[0] < '0' || text[0] > '0' + HD_MAX || text[1])
		end_wrong_usage("--hd", text, "a number from 0 to 3");
	return (uint32_t)(text[0] - '0');
}

struct demo_options demo_options_parse(int argc, char **argv)
{
	struct demo_options o = {.scene = "talking", .seed = 1};
	const char *hd = NULL;

	for (int c; (c = getopt_long(argc, argv, "", long_options, NULL)) != -1;) {
		if (c == 's')
			o.seconds = parse_seconds(optarg);
		else if (c == 'i')
			o.sim = true;
		else if (c == 'j')
			o.json = true;
		else if (c == 'c')
			o.scene = optarg;
		else if (c == 'd')
			o.seed = parse_seed(optarg);
		else if (c == 'x')
			o.stress = o.sim = true;
		else if (c == 'b')
			o.calibrate = o.sim = true;
		else if (c == 'n')
			hd = optarg;
		else if (c == 'k')
			o.keep_dir = optarg;
		else {
			fputs(usage, c == 'h' ? stdout : stderr);
			exit(c == 'h' ? EXIT_SUCCESS : EXIT_USAGE);
		}
	}
	if (optind < argc)
		end_wrong_usage("argument", argv[optind], "expected");
	if (o.seconds == 0)
		o.seconds = o.stress ? 60 : o.calibrate ? 10 : 20;
	if (o.calibrate && o.stress)
		end_wrong_usage("--calibrate", "", "possible with --stress");
	if (o.stress && o.seconds < STRESS_SECONDS_MIN)
		end_wrong_usage("--seconds", "with --stress", "at least 15");
	if (hd && !o.sim)
		end_wrong_usage("--hd", hd, "possible without --sim");
	o.hd_count = hd ? parse_hd(hd) : o.sim ? HD_MAX : 0;
	return o;
}
