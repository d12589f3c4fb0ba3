/*
 * Asks a running station over its control socket.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

/* Whether a station runs there; says nothing. */
bool control_listens(const char *socket_dir);

/* Calls `method` with `parameters` (taken over; NULL for none). Returns 0 and the reply's
 * parameters (the caller's) or an exit code, after a message on stderr that says what is wrong. */
int control_ask(json_t **out, const char *socket_dir, const char *method, json_t *parameters);

/* The same of a method whose reply brings a file descriptor: the caller's, -1 when none came. */
int control_ask_fd(json_t **out, int *fd, const char *socket_dir, const char *method);

/* Calls a method that lasts as long as the connection: *fd, the caller's, which becomes readable
 * when the station ends it. Returns as control_ask(). */
int control_hold(int *fd, const char *socket_dir, const char *method);

/* Gets the parameters of one reply; false: enough. */
typedef bool control_reply_fn(const json_t *parameters, void *user);

/* Calls a method that replies again and again, until the station or `take` ends it. Returns 0 or an
 * exit code, as control_ask(). */
int control_follow(const char *socket_dir, const char *method, control_reply_fn *take, void *user);
