/*
 * The programs of the closed rig: the station and its emulated cameras, started and killed by a
 * test. Failing is cmocka's.
 */
#pragma once

#include <sys/types.h>

#include "protocol/stage_client.h"

struct rig_programs {
	const char *build;  /* directory of the programs */
	const char *device; /* of the gpio-sim chip whose line 0 triggers */
	const char *dir;    /* where the config is, and the station's sockets */
	pid_t station, cameras[2];
	struct stage_client *client; /* NULL: none connected */
};

/* Camera `index` with the serial number IR0 or IR1 on a bus of its own; `fault` is one more option
 * and its value, or NULLs. */
void rig_plug_in(struct rig_programs *rig, int index, const char *fault, const char *value);

/* The station, and a subscriber that it has accepted. */
void rig_start_station(struct rig_programs *rig);

/* Ends a program by this signal and waits for its end. 0 is none. */
void rig_kill(pid_t *program, int signal_number);

/* The next event, or what the client says. */
int rig_next_event(struct rig_programs *rig, struct stage_event *out);

/* Ends all of them and closes the client. */
void rig_end(struct rig_programs *rig);
