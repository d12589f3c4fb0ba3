/*
 * What stagectl sim play says of a scene that was played.
 */
#pragma once

#include <stdint.h>

#include "sim/play.h"

struct play_report {
	const struct sim_script *script;
	const struct score *score;
	const struct sim_play_cost *cost;
	const char *level;
	uint64_t seed;
	uint64_t blobs_lost, markers_lost;
	int64_t elapsed_ns;
};

/* To standard output. */
void play_report_print_json(const struct play_report *report);
void play_report_print_table(const struct play_report *report);
