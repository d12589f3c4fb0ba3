/*
 * Finds what shines steadily on an empty stage - lamps, windows, the rings of other cameras - and
 * makes a mask of it. Pure; one finder per camera.
 */
#pragma once

#include <stdint.h>

#include "track/blobs/mask.h"

#define MASK_PLACE_MAX 256

/* A place where something shone, and how often. */
struct mask_place {
	float x_px, y_px;                           /* where it was first */
	float left_px, right_px, top_px, bottom_px; /* of all that was seen there */
	uint32_t seen_count;
	uint32_t seen_in; /* the last set, counted from 1 */
};

struct mask_finder {
	uint32_t set_count, spot_count, place_count;
	struct mask_place places[MASK_PLACE_MAX];
};

void mask_finder_reset(struct mask_finder *finder);
void mask_finder_add(struct mask_finder *finder, const struct blob_set *set);

struct mask_finding {
	uint32_t steady_count;   /* places in the mask */
	double unsteady_per_set; /* spots that move or flicker: nobody should be there */
};

/* The steady places, those that touch joined, clipped to the image. When there are more than fit,
 * the nearest are joined. */
struct mask_finding mask_finder_result(const struct mask_finder *finder, int width_px,
				       int height_px, struct mask *out);
