/*
 * stagectl trigger list: what can fire a stage, chips and adapters that can be seen now.
 */
#include <jansson.h>
#include <stdio.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"
#include "ctl/program_drivers.h"
#include "ctl/verb.h"

static json_t *text_json(const char *text)
{
	json_t *json = json_string(text);

	return json ? json : json_string("(not UTF-8)");
}

static void add_trigger(const struct trigger_info *info, void *user)
{
	json_array_append_new(
		user, json_pack("{s:o, s:o, s:o}", "address", text_json(info->address), "device",
				text_json(info->device), "lines", text_json(info->lines)));
}

static void print_table(const json_t *triggers)
{
	size_t index;
	json_t *one;

	if (json_array_size(triggers) == 0)
		puts("no GPIO chip and no USB adapter can be seen");
	else
		printf("%-24s %-36s %s\n", "address", "device", "lines");
	json_array_foreach((json_t *)triggers, index, one)
		printf("%-24s %-36s %s\n", json_string_value(json_object_get(one, "address")),
		       json_string_value(json_object_get(one, "device")),
		       json_string_value(json_object_get(one, "lines")));
}

static int list(bool json)
{
	json_t *triggers = json_array();
	struct diag diag = {0};
	int err = 0;

	for (size_t d = 0; live_triggers[d]; d++) {
		const struct trigger_driver *driver = live_triggers[d];
		int driver_err = driver->list ? driver->list(add_trigger, triggers, &diag) : 0;

		if (driver_err)
			err = driver_err;
	}
	if (!json)
		print_table(triggers);
	else
		print_json(json_pack("{s:O}", "triggers", triggers));
	json_decref(triggers);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err ? EXIT_CODE_DEVICE : EXIT_CODE_OK;
}

int verb_trigger_list(const struct verb *verb, int argc, char **argv)
{
	bool json = false;
	const struct argument arguments[] = {
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	return parsed == ARGUMENTS_OK ? list(json) : arguments_exit_code(parsed);
}
