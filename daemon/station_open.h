/*
 * The devices of a station, opened together. Control thread.
 */
#pragma once

#include "daemon/station.h"

/* All of them, or an exit code after a message; what was opened by then is the station's to close.
 */
enum exit_code station_open_devices(struct station *station, struct diag *diag);

/* What a failed open says: a file that is missing or wrong is bad input (a recording, or its
 * address); all else is the device. */
enum exit_code station_open_exit_code(int err);

/* Of the shots: the trigger's, or the cameras' own. */
int64_t station_find_period_ns(const struct station *station);
