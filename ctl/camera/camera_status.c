/*
 * A look into the list of cameras that GetStatus brings.
 */
#include "ctl/camera/camera_status.h"

#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/control_client.h"

int camera_status(json_t **out, const char *socket_dir, const char *name)
{
	json_t *reply, *camera, *found = NULL;
	size_t index;
	int code = control_ask(&reply, socket_dir, "org.stage.Control.GetStatus", NULL);

	if (code)
		return code;
	json_array_foreach(json_object_get(json_object_get(reply, "status"), "cameras"), index,
			   camera)
	{
		const char *other = json_string_value(json_object_get(camera, "name"));

		if (!found && other && strcmp(other, name) == 0)
			found = json_incref(camera);
	}
	json_decref(reply);
	if (!found) {
		fprintf(stderr,
			"stagectl: the station has no camera %s; stagectl status lists them, and "
			"an address looks like sim:ir1\n",
			name);
		return EXIT_CODE_DEVICE;
	}
	*out = found;
	return EXIT_CODE_OK;
}
