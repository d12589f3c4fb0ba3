/*
 * A board waved before a running station: switches it to calibrating, searches the newest whole
 * shot again and again on all processors, tells the operator what is missing, and ends by itself
 * when there is enough.
 */
#pragma once

#include <signal.h>

#include "config/calibration.h"
#include "ctl/calibrate/calibrate_search.h"

struct live_options {
	const char *socket_dir;
	const char *kept_path; /* where the corners are kept meanwhile */
	double seconds_max;    /* then it is enough; up to twice as long if nothing can be solved;
				* 0: no limit */
	bool json;
};

/* How the station is. Both get 0 or an exit code, after a message on stderr. */
struct live_station {
	char state[32];
	char config_path[4096];
};
int calibrate_live_look(struct live_station *station, const char *socket_dir);

/* Brings a new rig into use, if the station loads the one of `config_path`. */
int calibrate_live_reload(const char *socket_dir);

/* Gathers until it is enough or `*stop`. The station is configured again when it returns. Returns
 * 0 or an exit code, after messages; then nothing is held. */
int calibrate_live(struct observations *observations, struct picture_counts *counts,
		   const struct calibration *calibration, const struct board *board,
		   const struct live_options *options, const volatile sig_atomic_t *stop);
