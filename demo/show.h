/*
 * What a demonstration shows: progress, a live table on a terminal, a summary for people or for
 * programs.
 */
#pragma once

#include <stdio.h>

#include "demo/calibrate.h"
#include "demo/referee.h"
#include "demo/report.h"
#include "demo/stand.h"
#include "demo/stress.h"

struct demo_facts {
	const char *mode; /* "gige" or "sim" */
	const char *scene;
	uint64_t seed;
	uint32_t camera_count;
	double rate_hz;       /* asked for */
	double seconds;       /* judged */
	double startup_s;     /* from start to the first right label; NaN = none came */
	bool cameras_counted; /* `cameras` is known */
	struct camera_counts cameras;
	struct station_report station;
	uint32_t hd_camera_count;
	uint64_t hd_shots;                            /* marker sets that name an HD frame */
	const struct stress *stress;                  /* NULL: in peace */
	const struct calibration_report *calibration; /* NULL: it had its rig */
	bool ended_early;                             /* the stream ended before its time */
};

/* Clears the terminal and draws the state: the worst labels first, as many as fit. */
void show_table(FILE *out, const struct referee *referee, const struct results *results,
		const struct demo_facts *facts);

/* The same in one line. */
void show_line(FILE *out, const struct referee *referee, const struct results *results,
	       const struct demo_facts *facts);

void show_summary(FILE *out, const struct referee *referee, const struct results *results,
		  const struct demo_facts *facts);
void show_json(FILE *out, const struct referee *referee, const struct results *results,
	       const struct demo_facts *facts);

bool demo_has_passed(const struct referee *referee, const struct results *results,
		     const struct demo_facts *facts);
