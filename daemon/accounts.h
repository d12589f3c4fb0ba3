/*
 * Where every shot and frame went, in one struct: the status and the stream show the same.
 */
#pragma once

#include "daemon/station.h"
#include "protocol/encode.h"

/* Control thread. The texts are constant, or the station's. Takes a look at the heartbeats. */
void station_accounts(struct station *station, struct stream_statistics *out);

/* Frames that the simulator itself handed over late since its world was opened. */
uint64_t sim_late_since_open(const struct station *station);
