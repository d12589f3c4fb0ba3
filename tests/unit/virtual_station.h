/*
 * A station on a simulated stage in virtual time: the same on any machine, however slow.
 */
#pragma once

#include "daemon/station.h"

/* Writes the stage into a directory of its own, opens and starts the station. `extra_yaml` goes
 * into its config. */
struct station *virtual_station_start(const char *scene, uint32_t hd_count, const char *extra_yaml);

/* The same, configured and not started; `remove`: a file or directory of the stage that is taken
 * away first, or NULL. */
struct station *virtual_station_configure(const char *scene, uint32_t hd_count,
					  const char *extra_yaml, const char *remove);

/* Runs until `time_s` of the scene, as the control thread would. */
void virtual_station_run_to(struct station *station, double time_s);
void virtual_station_end(struct station *station);

uint64_t virtual_station_events(const struct station *station, uint32_t camera,
				enum ledger_event event);
