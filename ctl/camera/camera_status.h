/*
 * What the running station says of one of its cameras.
 */
#pragma once

#include <jansson.h>

/* Its object in the station's status, the caller's. Returns 0 or an exit code after a message. */
int camera_status(json_t **out, const char *socket_dir, const char *name);
