/*
 * What an operator sees of a calibration in the terminal.
 */
#pragma once

#include <jansson.h>
#include <stdio.h>

#include "calib/board/coverage.h"
#include "calib/report/verdict.h"
#include "ctl/calibrate/calibrate_read.h"

/* A bar on stderr, for calibrate_read(). */
void screen_progress(const struct picture_progress *progress, void *user);

/* A small picture per camera of where its corners are, and what is missing. `counts` may be NULL:
 * the views did not come from pictures. */
void screen_coverage(const struct observations *observations,
		     const struct camera_coverage *coverage, const struct picture_counts *counts);
void screen_verdict(const struct verdict *verdict);

/* Their parts: a line of a camera's picture, of COVERAGE_ROWS / 2; what its views are; what is
 * missing in them. */
void screen_camera_line(FILE *out, const struct camera_coverage *camera, int line);
void screen_camera_facts(char *text, size_t size, const struct camera_coverage *camera,
			 const struct picture_counts *counts);
void screen_camera_missing(char *text, size_t size, const struct camera_coverage *camera,
			   bool alone);

/* The same as JSON; a new reference, or NULL. */
json_t *screen_coverage_json(const struct observations *observations,
			     const struct camera_coverage *coverage,
			     const struct picture_counts *counts);
json_t *screen_verdict_json(const struct verdict *verdict);
