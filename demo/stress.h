/*
 * A demonstration under fire: programs that hog the machine, subscribers that stop or are killed, a
 * camera that is unplugged, clients that send garbage; and whether the station bore it all.
 */
#pragma once

#include <jansson.h>
#include <stdio.h>
#include <sys/types.h>

#include "demo/referee.h"
#include "demo/stand.h"

#define STRESS_HOGS 2

struct stress {
	const struct stand *stand; /* borrowed */
	double seconds;
	int64_t begin_ns, next_look_ns;
	uint32_t step; /* of the programme, done so far */
	pid_t hogs[STRESS_HOGS], stopped, killed;
	uint32_t garbage_stream, garbage_control; /* connections that sent some */
	int64_t back_ns; /* exposure of the first shot with the camera back; 0 = not yet */
	long rss_before_kb, rss_after_kb; /* of the station; 0 = not known */

	/* as the station says */
	bool fifo, camera_named, slow_named;
	uint64_t slow_lost, cut_off_stream, cut_off_control;
	uint64_t lost, incomplete, sim_late;
};

/* The line of YAML of `sim:` that makes the simulator unplug the camera. Of scene time. */
int stress_faults_yaml(char *text, size_t size, double seconds);

/* When judging begins. */
void stress_begin(struct stress *stress, const struct stand *stand, double seconds);

/* Does what is due, every few milliseconds. */
void stress_step(struct stress *stress, int64_t now_ns);
void stress_see_set(struct stress *stress, const struct stage_marker_set *set);

/* While the station still runs. */
void stress_finish(struct stress *stress);

/* Ends its processes; a zeroed stress is fine. */
void stress_stop(struct stress *stress);

bool stress_has_passed(const struct stress *stress, const struct referee *referee);
void stress_show(FILE *out, const struct stress *stress, const struct referee *referee);
json_t *stress_json(const struct stress *stress, const struct referee *referee);
