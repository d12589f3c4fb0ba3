/*
 * stagectl: how an operator looks at a station and works with recordings. A table of verbs.
 */
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/verb.h"

static const struct verb verbs[] = {
	{"status", "", "Says how the running station is doing", verb_status},
	{"start", "", "Makes the station capture, solve and stream", verb_start},
	{"stop", "", "Makes it stop; devices stay open", verb_stop},
	{"rig reload", "", "Loads the calibration again and swaps it in, also while live",
	 verb_rig_reload},
	{"camera list", "", "Lists the cameras that can be seen now", verb_camera_list},
	{"camera show", "NAME|ADDRESS", "Says what a camera is and does", verb_camera_show},
	{"camera preview", "NAME|ADDRESS|all", "Saves an image, with spots and names",
	 verb_camera_preview},
	{"camera mask", "NAME|ADDRESS", "Shows, finds or clears where spots do not count",
	 verb_camera_mask},
	{"camera noise", "NAME|ADDRESS", "Measures a camera's noise model", verb_camera_noise},
	{"trigger list", "", "Lists the GPIO chips and USB adapters that can be seen now",
	 verb_trigger_list},
	{"stream tap", "", "Subscribes to the running station and prints every shot",
	 verb_stream_tap},
	{"calibrate board", "", "Makes a PDF of a calibration board, true to scale",
	 verb_calibrate_board},
	{"calibrate cameras", "", "Makes a rig from a board that is waved, live or recorded",
	 verb_calibrate_cameras},
	{"calibrate actor", "NAME", "Learns an actor's neutral and the range of motion of the face",
	 verb_calibrate_actor},
	{"calibrate origin", "", "Sets the stage frame by a board on the floor or an L-frame",
	 verb_calibrate_origin},
	{"calibrate refine", "", "Puts cameras right that were bumped or drifted, by the markers",
	 verb_calibrate_refine},
	{"calibrate list", "CONFIG|RIG", "Lists the revisions of a rig", verb_calibrate_list},
	{"calibrate show", "CONFIG|RIG", "Says what a revision was made from and is worth",
	 verb_calibrate_show},
	{"calibrate rollback", "CONFIG|RIG", "Brings an earlier revision into force again",
	 verb_calibrate_rollback},
	{"config check", "CONFIG", "Checks a config and all that it names", verb_config_check},
	{"doctor", "[CONFIG]", "Says what of machine and devices would spoil a shooting day",
	 verb_doctor},
	{"process", "CONFIG", "Tracks recordings: one JSON object per shot", verb_process},
	{"sim list", "", "Lists the scenes of the simulator", verb_sim_list},
	{"sim play", "SCENE", "Tracks a simulated scene and scores it against its truth",
	 verb_sim_play},
	{"sim preview", "SCENE", "Draws what all cameras of a scene see, with the truth",
	 verb_sim_preview},
	{"sim record", "DIR", "Writes a simulated recording with its truth", verb_sim_record},
};

#define VERB_COUNT (sizeof(verbs) / sizeof(verbs[0]))

static void print_verb(const struct verb *verb, FILE *out)
{
	char left[64];

	snprintf(left, sizeof(left), "%s %s", verb->name, verb->arguments);
	fprintf(out, "  %-32s %s\n", left, verb->summary);
}

static void print_help(FILE *out)
{
	fputs("Usage: stagectl VERB [arguments] [--json] [--help]\n"
	      "Looks at a motion-capture station and works with its recordings.\n\nVerbs:\n",
	      out);
	for (size_t i = 0; i < VERB_COUNT; i++)
		print_verb(&verbs[i], out);
	fputs("\nstagectl VERB --help tells the options of a verb.\n\n", out);
	exit_codes_print(out);
}

/* Words of the command line that the verb's name takes, 0 when it is another verb. */
static int match_words(const struct verb *verb, int argc, char **argv)
{
	const char *space = strchr(verb->name, ' ');

	if (!space)
		return argc >= 1 && strcmp(argv[0], verb->name) == 0 ? 1 : 0;
	size_t first_length = (size_t)(space - verb->name);
	if (argc < 2 || strlen(argv[0]) != first_length ||
	    strncmp(argv[0], verb->name, first_length) != 0)
		return 0;
	return strcmp(argv[1], space + 1) == 0 ? 2 : 0;
}

static bool is_of_family(const struct verb *verb, const char *first)
{
	size_t length = strlen(first);

	return strncmp(verb->name, first, length) == 0 && verb->name[length] == ' ';
}

/* Are there verbs of two words that begin with this one? */
static bool find_family(const char *first)
{
	for (size_t i = 0; i < VERB_COUNT; i++)
		if (is_of_family(&verbs[i], first))
			return true;
	return false;
}

static void print_family(const char *first, FILE *out)
{
	fprintf(out, "stagectl %s ...\n", first);
	for (size_t i = 0; i < VERB_COUNT; i++)
		if (is_of_family(&verbs[i], first))
			print_verb(&verbs[i], out);
}

static bool asks_for_help(const char *word)
{
	return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0;
}

/* No verb, or the first word of several: tells what there is. */
static int refuse(int argc, char **argv)
{
	bool has_family = argc >= 2 && find_family(argv[1]);

	if (has_family && argc == 3 && asks_for_help(argv[2])) {
		print_family(argv[1], stdout);
		return EXIT_CODE_OK;
	}
	if (argc > 2 || (argc == 2 && !has_family))
		fprintf(stderr, "stagectl: no such verb: %s%s%s\n", argv[1], argc > 2 ? " " : "",
			argc > 2 ? argv[2] : "");
	if (has_family)
		print_family(argv[1], stderr);
	else
		print_help(stderr);
	return EXIT_CODE_USAGE;
}

static int run(int argc, char **argv)
{
	if (argc >= 2 && strcmp(argv[1], "--version") == 0) {
		puts("stagectl " STAGE_VERSION);
		return EXIT_CODE_OK;
	}
	if (argc >= 2 && asks_for_help(argv[1])) {
		print_help(stdout);
		return EXIT_CODE_OK;
	}
	for (size_t i = 0; i < VERB_COUNT; i++) {
		int words = match_words(&verbs[i], argc - 1, argv + 1);

		if (words > 0)
			return verbs[i].run(&verbs[i], argc - words, argv + words);
	}
	return refuse(argc, argv);
}

/* What was printed is nobody's when the disk is full. */
int main(int argc, char **argv)
{
	int code = run(argc, argv);

	errno = 0;
	if (fflush(stdout) == 0 && !ferror(stdout))
		return code;
	fprintf(stderr,
		"stagectl: standard output cannot be written%s%s: make room, or send it "
		"elsewhere\n",
		errno ? ": " : "", errno ? strerror(errno) : "");
	return code ? code : EXIT_CODE_INTERNAL;
}
