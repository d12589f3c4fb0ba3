/*
 * stagectl camera list: what every driver can see now, and with --watch what comes and goes.
 */
#include <stdio.h>
#include <stdlib.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/camera/camera_inventory.h"
#include "ctl/camera/camera_watch.h"
#include "ctl/print_json.h"

static void print_table(const struct inventory *inventory)
{
	if (inventory->count == 0)
		puts("no camera can be seen");
	else
		printf("%-32s %-28s %s\n", "address", "model", "serial");
	for (uint32_t c = 0; c < inventory->count; c++)
		printf("%-32s %-28s %s\n", inventory->cameras[c].address,
		       inventory->cameras[c].model, inventory->cameras[c].serial);
}

static void print_object(const struct inventory *inventory)
{
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < inventory->count; c++)
		json_array_append_new(cameras, inventory_camera_json(&inventory->cameras[c]));
	print_json(json_pack("{s:o}", "cameras", cameras));
}

static int list(bool json)
{
	struct inventory *inventory = calloc(1, sizeof(*inventory));
	struct diag diag = {0};

	if (!inventory)
		return EXIT_CODE_INTERNAL;
	int err = inventory_take(inventory, &diag);

	(json ? print_object : print_table)(inventory);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	free(inventory);
	return err ? EXIT_CODE_DEVICE : EXIT_CODE_OK;
}

int verb_camera_list(const struct verb *verb, int argc, char **argv)
{
	bool json = false, watch = false;
	uint64_t seconds = 0;
	const struct argument arguments[] = {
		{"watch", NULL, "go on, and print every arrival and departure", .flag = &watch},
		{"seconds", "N", "with --watch: how long (default: until Ctrl-C)",
		 .count = &seconds},
		{"json", NULL, "print one JSON object, with --watch one an event", .flag = &json},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	return watch ? camera_watch(json, seconds) : list(json);
}
