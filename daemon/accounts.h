/*
 * Where every shot and frame went, in one struct: the status and the stream show the same.
 */
#pragma once

#include "daemon/station.h"
#include "protocol/encode.h"

/* Control thread. The texts are constant, or the station's. */
void station_accounts(const struct station *station, struct stream_statistics *out);

/* Frames that the simulator itself handed over late. */
uint64_t station_sim_late_count(const struct station *station);
