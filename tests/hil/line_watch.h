/*
 * Every change of one GPIO output, by whomever, from the kernel's own trace: none is missed however
 * slow the reader is, and each has the kernel's time. One thread.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct line_watch {
	int fd;
	unsigned int number; /* of the line among all of the machine */
	char instance[96];   /* of the trace */
	char text[1024];     /* read and not yet looked at */
	size_t text_bytes;
};

struct line_change {
	bool level;
	int64_t time_ns; /* CLOCK_MONOTONIC, in whole microseconds */
};

/* `device` is the directory of a gpio-sim device (/sys/devices/platform/gpio-sim.0), `offset` the
 * line's in its only chip. Returns 0 or a negative errno. close undoes open. */
int line_watch_open(struct line_watch *watch, const char *device, unsigned int offset);
void line_watch_close(struct line_watch *watch);

/* The next time that the line was set, also to what it was: 0, -ETIMEDOUT or another errno. */
int line_watch_next(struct line_watch *watch, int timeout_ms, struct line_change *out);
