/*
 * What the station says of itself, asked over its control socket like any operator does.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define REPORT_HD_MAX 8

struct hd_report {
	char name[32];
	uint64_t frames;
	uint64_t lost;      /* damaged, not delivered, or refused because there was no room */
	uint64_t off_phase; /* frames of shots that HD is not to expose in */
	bool phase_known;
	uint32_t phase; /* of the newest frame */
};

struct station_report {
	bool known;
	uint64_t sim_late; /* frames that the simulator in the station handed over late */
	uint32_t hd_count;
	struct hd_report hd[REPORT_HD_MAX];
};

/* Not known when the station does not answer; then a message is on stderr. */
void report_ask(struct station_report *report, const char *socket_dir);
