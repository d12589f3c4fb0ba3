/*
 * By what light the station runs: the config's plan, or, while it calibrates, one with few and long
 * pulses, before which a board is waved and all pictures are offered. Control thread, while nothing
 * runs.
 */
#pragma once

#include "daemon/station.h"

/* Opens the simulated stage, where the config wants one. Returns 0 or a negative errno with a
 * message. */
int station_open_world(struct station *station, struct diag *diag);

/* Before the threads start. Errors as above; then it is the config's plan again. */
int station_begin_light(struct station *station, bool calibrating, struct diag *diag);

/* After they have ended. */
void station_end_light(struct station *station);
