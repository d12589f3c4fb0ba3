/*
 * stage-sim-gige as a child process, on loopback addresses of its own, so that tests can run side
 * by side.
 */
#pragma once

#include <stdint.h>
#include <sys/types.h>

struct gige_child {
	pid_t pid;
	char first_address[16];
};

/* The address of camera `index` of the child. */
void gige_child_address(const struct gige_child *child, uint32_t index, char address[16]);

/* Starts it with four cameras and waits until they answer. `extra` are further arguments,
 * NULL-terminated. Returns 0, or -1 when it ended instead. `log_path` gets its messages. */
int gige_child_start(struct gige_child *child, const char *program, uint32_t block,
		     const char *const *extra, const char *log_path);

/* Sends `signal_number` and waits. Returns the wait status. */
int gige_child_end(struct gige_child *child, int signal_number);
