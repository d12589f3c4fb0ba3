/*
 * The table. What is not in it is refused.
 */
#include "daemon/station_states.h"

#include <stddef.h>

static const struct {
	enum station_state from;
	enum station_event event;
	enum station_state to;
} ways[] = {
	{STATION_IDLE, STATION_CONFIGURE, STATION_CONFIGURED},
	{STATION_CONFIGURED, STATION_START, STATION_RUNNING},
	{STATION_CONFIGURED, STATION_CALIBRATE, STATION_CALIBRATING},
	{STATION_CONFIGURED, STATION_CLOSE, STATION_IDLE},
	{STATION_RUNNING, STATION_OVER, STATION_ENDED},
	{STATION_RUNNING, STATION_STOP, STATION_CONFIGURED},
	{STATION_CALIBRATING, STATION_OVER, STATION_ENDED},
	{STATION_CALIBRATING, STATION_STOP, STATION_CONFIGURED},
	{STATION_ENDED, STATION_STOP, STATION_CONFIGURED},
};

static const char *const names[STATION_STATE_COUNT] = {
	[STATION_IDLE] = "idle",       [STATION_CONFIGURED] = "configured",
	[STATION_RUNNING] = "running", [STATION_CALIBRATING] = "calibrating",
	[STATION_ENDED] = "ended",
};

bool station_next_state(enum station_state from, enum station_event event, enum station_state *to)
{
	for (size_t w = 0; w < sizeof(ways) / sizeof(ways[0]); w++)
		if (ways[w].from == from && ways[w].event == event) {
			*to = ways[w].to;
			return true;
		}
	return false;
}

bool station_state_captures(enum station_state state)
{
	return state == STATION_RUNNING || state == STATION_CALIBRATING || state == STATION_ENDED;
}

const char *station_state_name(enum station_state state)
{
	return names[state];
}
