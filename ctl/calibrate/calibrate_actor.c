/*
 * stagectl calibrate actor: a neutral, the range of motion of a face, and the file that the tracker
 * knows the actor by.
 */
#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/calibrate/actor_session.h"

static bool is_name(const char *name)
{
	return *name && strlen(name) < NAME_BYTES &&
	       strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
		       strlen(name);
}

static int calibrate(const struct actor_source *source, const struct actor_wish *wish, bool json)
{
	struct actor_feed *feed = NULL;
	struct actor_screen screen;
	struct diag diag = {0};
	int code = actor_feed_open(&feed, source, &diag);

	if (code == EXIT_CODE_OK) {
		actor_screen_begin(&screen, json);
		code = actor_session_run(feed, &screen, wish, &diag);
		actor_screen_finish(&screen);
	}
	actor_feed_close(feed);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return code;
}

int verb_calibrate_actor(const struct verb *verb, int argc, char **argv)
{
	struct actor_source source = {.socket_dir = DEFAULT_SOCKET_DIR, .seed = 1};
	struct actor_wish wish = {.out_dir = "actors", .pose_s = 8};
	bool json = false;
	const struct argument arguments[] = {
		{"from", "CONFIG", "look at the recording of this config, not at the station",
		 .text = &source.config},
		{"sim", "SCENE", "look at a scene of the simulator, as fast as it goes",
		 .text = &source.scene},
		{"seed", "N", "of the scene (default 1)", .count = &source.seed,
		 .count_max = UINT64_MAX},
		ARGUMENT_SOCKET_DIR(&source.socket_dir),
		{"layout", "FILE", "the markers as worn (default: those of the station or config)",
		 .text = &source.layout_path},
		{"actor", "NAME", "whom the source calls the actor (default: NAME)",
		 .text = &source.actor},
		{"out", "DIR", "where NAME.yaml goes (default: actors)", .text = &wish.out_dir},
		{"fresh", NULL, "begin anew instead of going on with an interrupted capture",
		 .flag = &wish.fresh},
		{"anyway", NULL, "take a neutral that is far from the layout",
		 .flag = &wish.anyway},
		{"pose-seconds", "S", "without a terminal: wait so long for a pose (default 8)",
		 .number = &wish.pose_s},
		{"json", NULL, "print one JSON object an event", .flag = &json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &wish.name, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (!is_name(wish.name)) {
		fprintf(stderr,
			"stagectl: '%s': an actor's name has 1 to %d letters A-Z and a-z, digits, "
			"_ "
			"or -, as it names a file\n",
			wish.name, NAME_BYTES - 1);
		return EXIT_CODE_USAGE;
	}
	if (source.config && source.scene) {
		fprintf(stderr, "stagectl: --from and --sim exclude each other\n");
		return EXIT_CODE_USAGE;
	}
	if (!source.actor)
		source.actor = wish.name;
	return calibrate(&source, &wish, json);
}
