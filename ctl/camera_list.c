/*
 * stagectl camera list: what every driver can see now.
 */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"
#include "ctl/program_drivers.h"

static void add_camera(const struct camera_info *info, void *user)
{
	json_array_append_new(user, json_pack("{s:s, s:s, s:s}", "address", info->address, "model",
					      info->model, "serial", info->serial));
}

static void print_table(const json_t *cameras)
{
	size_t index;
	json_t *camera;

	if (json_array_size(cameras) == 0)
		puts("no camera can be seen");
	else
		printf("%-32s %-28s %s\n", "address", "model", "serial");
	json_array_foreach((json_t *)cameras, index, camera)
		printf("%-32s %-28s %s\n", json_string_value(json_object_get(camera, "address")),
		       json_string_value(json_object_get(camera, "model")),
		       json_string_value(json_object_get(camera, "serial")));
}

int verb_camera_list(const struct verb *verb, int argc, char **argv)
{
	bool json = false;
	struct diag diag = {0};
	int err = 0;
	const struct argument arguments[] = {
		{"json", NULL, "print one JSON object", .flag = &json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	json_t *cameras = json_array();
	for (size_t d = 0; live_drivers[d]; d++) {
		int driver_err = live_drivers[d]->list
					 ? live_drivers[d]->list(add_camera, cameras, &diag)
					 : 0;
		if (driver_err)
			err = driver_err;
	}
	if (json) {
		json_t *object = json_pack("{s:O}", "cameras", cameras);

		print_json(object);
	} else {
		print_table(cameras);
	}
	json_decref(cameras);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return err ? EXIT_CODE_DEVICE : EXIT_CODE_OK;
}
