/*
 * Finds a driver by the part of an address before the colon.
 */
#include <string.h>

#include "drivers/camera.h"
#include "drivers/trigger.h"

/* "sim, files, aravis" */
static void append_name(char *list, size_t size, const char *name)
{
	size_t used = strlen(list);

	if (used + 1 < size)
		snprintf(list + used, size - used, "%s%s", used ? ", " : "", name);
}

static bool has_name(const char *address, const char *name)
{
	size_t length = strcspn(address, ":");

	return strlen(name) == length && strncmp(address, name, length) == 0;
}

static const char *behind_colon(const char *address)
{
	const char *colon = strchr(address, ':');

	return colon ? colon + 1 : "";
}

const struct camera_driver *camera_driver_find(const struct camera_driver *const *drivers,
					       const char *address, const char **rest,
					       struct diag *diag)
{
	char known[256] = "";

	for (int i = 0; drivers[i]; i++) {
		if (has_name(address, drivers[i]->name) && *behind_colon(address)) {
			*rest = behind_colon(address);
			return drivers[i];
		}
		append_name(known, sizeof(known), drivers[i]->name);
	}
	diag_add(diag,
		 "camera address %s: no such driver; an address is driver:device and the drivers "
		 "are %s",
		 address, known);
	return NULL;
}

const struct trigger_driver *trigger_driver_find(const struct trigger_driver *const *drivers,
						 const char *address, const char **rest,
						 struct diag *diag)
{
	char known[256] = "";

	for (int i = 0; drivers[i]; i++) {
		if (has_name(address, drivers[i]->name)) {
			*rest = behind_colon(address);
			return drivers[i];
		}
		append_name(known, sizeof(known), drivers[i]->name);
	}
	diag_add(diag, "trigger %s: no such trigger; there are %s", address, known);
	return NULL;
}

uint32_t trigger_fires(const struct trigger_driver *const *drivers, const char *address)
{
	struct diag unread = {0};
	const char *rest;
	const struct trigger_driver *driver = trigger_driver_find(drivers, address, &rest, &unread);

	diag_finish(&unread);
	return driver && driver->fires ? driver->fires(rest) : 0;
}
