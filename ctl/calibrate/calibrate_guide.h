/*
 * What the operator who waves the board is told meanwhile: on a terminal in place, else a line now
 * and then, or JSON events.
 */
#pragma once

#include <stdbool.h>

#include "calib/board/coverage.h"
#include "ctl/calibrate/calibrate_search.h"

struct guide_facts {
	const struct observations *observations; /* chosen so far */
	const struct camera_coverage *coverage;  /* per camera */
	const struct picture_counts *counts;     /* per camera */
	uint32_t poses, poses_min;
	uint32_t near_count; /* poses left out as near-duplicates */
	uint64_t shots;      /* searched */
	uint64_t skipped;    /* pictures that were not looked at: a newer one was there */
	double seconds;      /* since it began */
};

struct guide {
	bool json, in_place;
	double next_line_s;
};

void guide_begin(struct guide *guide, bool json);
void guide_show(struct guide *guide, const struct guide_facts *facts);

/* 0 to 1; 1 only when it is enough: all cameras have what they need, and the poses are there. */
double guide_progress(const struct guide_facts *facts);
