/*
 * Where a rig is least certain, in words for whoever waves the board: which cameras see the place,
 * and where in their images. Pure.
 */
#pragma once

#include "calib/solve/uncertainty.h"

#define WHERE_CAMERAS 2 /* that tell the place: those in whose image it is furthest out */
#define WHERE_WORDS_BYTES 256

struct where_next {
	struct vec3 p_stage_m;
	double sigma_m;
	uint32_t seen_by; /* cameras */
	uint32_t camera_count;
	struct {
		uint32_t camera;
		double px[2];
		double range_m;
	} cameras[WHERE_CAMERAS];
};

/* `rt_stage_ref` takes the reference's coordinates to the stage's. */
struct where_next where_next(const struct uncertainty *uncertainty, const struct volume *volume,
			     const struct solution *solution,
			     const struct observations *observations,
			     const struct pose *rt_stage_ref);

/* "0.31 mm at (0.12, -0.05, 1.40) m, seen by 3 cameras: upper left in ir4, 1.3 m away". */
void where_next_words(const struct where_next *where, const struct observations *observations,
		      char words[WHERE_WORDS_BYTES]);
