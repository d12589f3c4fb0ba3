/*
 * Which spot is whose.
 */
#include <math.h>

#include "ctl/camera/sheet.h"

#define NEAR_PX 3.0 /* beyond a spot's own radius */

static double spot_radius_px(const struct blob *blob)
{
	return sqrt(blob->area_px2 / M_PI);
}

static struct sheet_mark *nearest_cross(struct sheet_tile *tile, uint32_t cross_count, double x_px,
					double y_px, double limit_px)
{
	struct sheet_mark *nearest = NULL;

	for (uint32_t i = 0; i < cross_count; i++) {
		double distance_px = hypot(tile->marks[i].x_px - x_px, tile->marks[i].y_px - y_px);

		if (distance_px <= limit_px) {
			limit_px = distance_px;
			nearest = &tile->marks[i];
		}
	}
	return nearest;
}

static void circle(struct sheet_tile *tile, uint32_t cross_count, const struct blob *blob)
{
	double radius_px = spot_radius_px(blob);
	const struct sheet_mark *cross =
		nearest_cross(tile, cross_count, blob->x_px, blob->y_px, radius_px + NEAR_PX);
	struct sheet_mark *ring =
		sheet_add_mark(tile, cross ? SHEET_SPOT : SHEET_STRAY, blob->x_px, blob->y_px);

	ring->radius_px = radius_px;
	ring->group = cross ? cross->group : -1;
}

static bool has_spot(const struct sheet_tile *tile, const struct sheet_mark *cross)
{
	for (uint32_t b = 0; b < tile->snapshot->blob_count; b++) {
		const struct blob *blob = &tile->snapshot->blobs[b];

		if (hypot(blob->x_px - cross->x_px, blob->y_px - cross->y_px) <=
		    spot_radius_px(blob) + NEAR_PX)
			return true;
	}
	return false;
}

uint32_t sheet_match_spots(struct sheet_tile *tile)
{
	uint32_t cross_count = tile->mark_count, found = 0;

	for (uint32_t b = 0; b < tile->snapshot->blob_count; b++)
		circle(tile, cross_count, &tile->snapshot->blobs[b]);
	for (uint32_t i = 0; i < cross_count; i++) {
		bool spot = has_spot(tile, &tile->marks[i]);

		found += spot;
		if (!spot)
			tile->marks[i].kind = SHEET_MISSED;
	}
	return found;
}
