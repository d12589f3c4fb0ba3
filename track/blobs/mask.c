/*
 * A pixel's square reaches half a pixel around its centre, which is where its coordinates are.
 */
#include "track/blobs/mask.h"

#include <stdbool.h>

static bool holds(const struct mask_area *area, const struct blob *blob)
{
	float x_px = blob->x_px + 0.5f - (float)area->x_px;
	float y_px = blob->y_px + 0.5f - (float)area->y_px;

	return x_px >= 0 && x_px < (float)area->width_px && y_px >= 0 &&
	       y_px < (float)area->height_px;
}

static bool is_masked(const struct mask *mask, const struct blob *blob)
{
	for (uint32_t a = 0; a < mask->area_count; a++)
		if (holds(&mask->areas[a], blob))
			return true;
	return false;
}

uint32_t mask_apply(const struct mask *mask, struct blob_set *set)
{
	uint32_t kept = 0, before = set->blob_count;

	if (mask->area_count == 0)
		return 0;
	for (uint32_t b = 0; b < before; b++)
		if (!is_masked(mask, &set->blobs[b]))
			set->blobs[kept++] = set->blobs[b];
	set->blob_count = kept;
	return before - kept;
}
