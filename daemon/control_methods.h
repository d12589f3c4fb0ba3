/*
 * What the control socket can be asked. Requests and replies are JSON; control.c carries them.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

#include "daemon/control.h"

struct control_context {
	struct station *station;
	const struct server *server; /* NULL until it listens */
	const struct control_stats *stats;
};

#define CAMERA_NONE (-1)

/* The reply to a request, new; or NULL: then an image of `*preview_camera` was asked for and the
 * reply is preview_reply() once it is there. Never fails: an error is a reply too. */
json_t *control_call(const struct control_context *context, const json_t *request,
		     int *preview_camera);

/* `ready`: the camera's preview slot holds an image; else the reply says that none came. */
json_t *preview_reply(struct station *station, int camera, bool ready);

/* The station as GetStatus returns it (status.c). */
json_t *station_status_json(const struct control_context *context);
