/*
 * The cameras that all drivers can see at one time.
 */
#pragma once

#include <jansson.h>

#include "base/diag.h"
#include "drivers/camera.h"

#define INVENTORY_MAX 128

struct inventory {
	uint32_t count;
	struct camera_info cameras[INVENTORY_MAX];
};

/* Asks every driver; network cameras take a second. Returns 0 or the errno of the last driver that
 * failed, with a message; what the others see is there all the same. */
int inventory_take(struct inventory *out, struct diag *diag);

/* NULL when it is not there. */
const struct camera_info *inventory_find(const struct inventory *inventory, const char *address);

json_t *inventory_camera_json(const struct camera_info *info);
