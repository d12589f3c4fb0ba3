/*
 * A calibration held against its limits.
 */
#pragma once

#include <stdbool.h>

#include "calib/solve/cross_check.h"
#include "calib/solve/solve.h"
#include "calib/solve/uncertainty.h"
#include "config/calibration.h"

#define VERDICT_LINES 4

struct verdict_line {
	const char *name, *unit;
	char of[NAME_BYTES]; /* the worst camera, or "" */
	double value, limit;
};

struct verdict {
	struct verdict_line lines[VERDICT_LINES];
	bool passed;
};

static inline bool verdict_line_passed(const struct verdict_line *line)
{
	return line->value <= line->limit; /* false for NaN */
}

struct verdict verdict_of(const struct calibration_limits *limits,
			  const struct observations *observations, const struct solution *solution,
			  const struct uncertainty *uncertainty, const struct cross_check *check);
