/*
 * stagectl start, stop, rig reload: what an operator tells the running station.
 */
#include <stdio.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/control_client.h"
#include "ctl/control_reply.h"
#include "ctl/print_json.h"

/* Prints `key` of the reply. */
static int tell(const struct verb *verb, int argc, char **argv, const char *method, const char *key)
{
	const char *socket_dir = DEFAULT_SOCKET_DIR;
	bool json = false;
	json_t *reply;
	const struct argument arguments[] = {
		ARGUMENT_SOCKET_DIR(&socket_dir),
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	int code = control_ask(&reply, socket_dir, method, NULL);
	if (code)
		return code;
	const char *text = control_reply_text(reply, key);
	if (text && json)
		print_json(json_incref(reply));
	else if (text)
		puts(text);
	code = text ? EXIT_CODE_OK : EXIT_CODE_CONNECTION;
	json_decref(reply);
	return code;
}

int verb_start(const struct verb *verb, int argc, char **argv)
{
	return tell(verb, argc, argv, "org.stage.Control.Start", "state");
}

int verb_stop(const struct verb *verb, int argc, char **argv)
{
	return tell(verb, argc, argv, "org.stage.Control.Stop", "state");
}

int verb_rig_reload(const struct verb *verb, int argc, char **argv)
{
	return tell(verb, argc, argv, "org.stage.Control.ReloadRig", "rig_revision");
}
