/*
 * The programs that a demonstration starts: each writes into a log file, ends with its parent, and
 * is ended by its own process id.
 */
#pragma once

#include <stdbool.h>
#include <sys/types.h>

#include "base/diag.h"

struct child {
	const char *name; /* for messages */
	pid_t pid;        /* 0 = not running */
	char log_path[4096];
};

/* Starts argv[0] with its output going to LOG_DIR/NAME.log. Returns 0 or a negative errno with a
 * message. `name` is borrowed. */
int child_start(struct child *child, const char *name, const char *log_dir, char *const argv[],
		struct diag *diag);

/* The same, but what it tells people, on stderr, goes where ours goes. */
int child_start_told(struct child *child, const char *name, const char *log_dir, char *const argv[],
		     struct diag *diag);

/* False once it has ended. */
bool child_is_running(struct child *child);

/* Asks it to end, insists after five seconds, and waits for it. Nothing when it is not running. */
void child_stop(struct child *child);

/* Adds that the child ended, and the last lines of its log. */
void child_explain(const struct child *child, struct diag *diag);

/* Copies the first line of the child's log that begins with `word`; false when there is none. */
bool child_find_line(const struct child *child, const char *word, char *line, size_t size);
