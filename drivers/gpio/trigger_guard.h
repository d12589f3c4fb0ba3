/*
 * The station's end of the guard: a process of its own (daemon/guard_main.c) that holds a copy of
 * the lines' descriptor and sets them dark when the station is gone, however it went, or when a
 * line is lit for longer than the station said, because it stands still.
 */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/diag.h"

/* The guard finds these open. */
enum guard_fd {
	GUARD_LINES = 3,
	GUARD_TIMER,   /* goes off when a line is lit too long; the station sets it */
	GUARD_STATION, /* socket: hangs up when the station is gone */
	GUARD_PAGE,    /* struct guard_page */
	GUARD_FD_END
};

struct guard_page {
	_Atomic uint32_t cut_count; /* times that it set the lines dark while the station lived */
};

struct trigger_guard {
	pid_t pid; /* 0: none runs */
	int timer_fd, station_fd;
	struct guard_page *page; /* shared with it */
	uint32_t cuts_seen;
};

/* `lines_fd` has `count` lines, which are dark at `dark_levels`. Returns when it is on guard: 0, or
 * -ECHILD with a message that begins with `who`. Control thread. */
int trigger_guard_start(struct trigger_guard *guard, int lines_fd, uint32_t count,
			uint32_t dark_levels, const char *who, struct diag *diag);

/* It sets the lines dark a last time and ends. A zeroed guard is fine. Control thread. */
void trigger_guard_stop(struct trigger_guard *guard);

/* The trigger thread, as all below; a system call each, real-time safe. Between watch and rest
 * lines may be lit: at `until_ns`, unless it is told another time, they are dark. */
void trigger_guard_watch(struct trigger_guard *guard, int64_t until_ns);
void trigger_guard_rest(struct trigger_guard *guard);
bool trigger_guard_lives(const struct trigger_guard *guard);

/* Whether it had to act since the last call. */
bool trigger_guard_has_cut(struct trigger_guard *guard);
