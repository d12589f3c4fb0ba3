/*
 * Asks a running station over its control socket.
 */
#pragma once

#include <jansson.h>

/* Calls `method` with `parameters` (taken over; NULL for none). Returns 0 and the reply's
 * parameters (the caller's) or an exit code, after a message on stderr that says what is wrong. */
int control_ask(json_t **out, const char *socket_dir, const char *method, json_t *parameters);
