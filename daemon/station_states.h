/*
 * The states of the station and the ways between them: one table. Pure.
 *
 *            configure            start, calibrate
 *     idle ─────────── configured ────────────────── running, calibrating ─── ended
 *            close                       stop                            over
 */
#pragma once

#include <stdbool.h>

enum station_state {
	STATION_IDLE,        /* nothing is open */
	STATION_CONFIGURED,  /* rig, layout and devices are open and checked; nothing runs */
	STATION_RUNNING,     /* captures, solves and streams; nothing is reconfigured */
	STATION_CALIBRATING, /* captures, with previews; solves no markers */
	STATION_ENDED,       /* all recordings are over; still answers and shows what there was */
	STATION_STATE_COUNT,
};

enum station_event {
	STATION_CONFIGURE,
	STATION_START,
	STATION_CALIBRATE,
	STATION_OVER, /* the last recording ended */
	STATION_STOP,
	STATION_CLOSE,
	STATION_EVENT_COUNT,
};

/* Where `event` leads from `from`; false, with `*to` untouched, where the table has no way. */
bool station_next_state(enum station_state from, enum station_event event, enum station_state *to);

/* In a state in which the capture threads have been started. */
bool station_state_captures(enum station_state state);

const char *station_state_name(enum station_state state);
