/*
 * A listening Unix stream socket that the station's group may use, in the place of a stale one.
 */
#pragma once

#include "base/diag.h"

/* Non-blocking, close-on-exec, mode 0660; the caller closes it and unlinks the path. A socket that
 * nobody listens on any more is replaced. Returns 0, -EADDRINUSE when somebody does listen, -EEXIST
 * when the path is not a socket, or another negative errno; each with a message in `diag`. */
int listen_unix(int *out_fd, const char *path, struct diag *diag);

/* Whether listen_unix() would refuse the place, with its errors and messages, and touches nothing.
 * 0 is no promise: it may lack a directory, or rights. */
int listen_check(const char *path, struct diag *diag);
