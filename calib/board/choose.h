/*
 * Which of many views a calibration is made from: near-duplicates are left out, and of the rest
 * those are taken that fill images, link cameras and show each camera enough. Pure; choosing again
 * from what was chosen changes nothing.
 */
#pragma once

#include "calib/board/observations.h"

struct choose_settings {
	uint32_t poses_max;
	double near_part; /* of the image's width: corners that moved less are the same view */
};

#define CHOOSE_SETTINGS_DEFAULT ((struct choose_settings){100, 0.01})

/* `near_count` gets how many poses were left out as near-duplicates. Returns 0 or -ENOMEM. */
int observations_choose(struct observations *chosen, const struct observations *all,
			const struct choose_settings *settings, uint32_t *near_count);
