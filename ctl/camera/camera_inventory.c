/*
 * Every driver's list in one.
 */
#include "ctl/camera/camera_inventory.h"

#include <string.h>

#include "ctl/program_drivers.h"

static void add_camera(const struct camera_info *info, void *user)
{
	struct inventory *inventory = user;

	if (inventory->count < INVENTORY_MAX)
		inventory->cameras[inventory->count++] = *info;
}

int inventory_take(struct inventory *out, struct diag *diag)
{
	int err = 0;

	out->count = 0;
	for (size_t d = 0; live_drivers[d]; d++) {
		int driver_err =
			live_drivers[d]->list ? live_drivers[d]->list(add_camera, out, diag) : 0;
		if (driver_err)
			err = driver_err;
	}
	return err;
}

const struct camera_info *inventory_find(const struct inventory *inventory, const char *address)
{
	for (uint32_t c = 0; c < inventory->count; c++)
		if (strcmp(inventory->cameras[c].address, address) == 0)
			return &inventory->cameras[c];
	return NULL;
}

json_t *inventory_camera_json(const struct camera_info *info)
{
	return json_pack("{s:s, s:s, s:s}", "address", info->address, "model", info->model,
			 "serial", info->serial);
}
