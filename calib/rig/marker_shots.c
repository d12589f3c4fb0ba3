/*
 * Two growing arrays.
 */
#include "calib/rig/marker_shots.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static int make_room(void **items, uint32_t *room, uint32_t wanted, size_t item_bytes)
{
	if (wanted <= *room)
		return 0;
	uint32_t more = wanted > 2 * *room ? wanted : 2 * *room;
	void *larger = realloc(*items, more * item_bytes);

	if (!larger)
		return -ENOMEM;
	*items = larger;
	*room = more;
	return 0;
}

static int add_spots(struct marker_shots *shots, uint32_t camera, const struct blob_set *set)
{
	void *spots = shots->spots;
	int err = make_room(&spots, &shots->spot_room, shots->spot_count + set->blob_count,
			    sizeof(*shots->spots));

	shots->spots = spots;
	for (uint32_t b = 0; !err && b < set->blob_count; b++) {
		const struct blob *blob = &set->blobs[b];

		if (!blob->flags)
			shots->spots[shots->spot_count++] =
				(struct seen_spot){shots->shot_count,
						   camera,
						   {blob->x_px, blob->y_px},
						   blob->sigma_px};
	}
	return err;
}

static bool is_wanted(const struct marker *marker)
{
	return marker->status == MARKER_MEASURED ||
	       (marker->status == MARKER_TWO_CAMERA && marker->label == LABEL_NONE);
}

static int add_points(struct marker_shots *shots, const struct marker_set *set)
{
	void *points = shots->points;
	int err = make_room(&points, &shots->point_room, shots->point_count + set->marker_count,
			    sizeof(*shots->points));

	shots->points = points;
	for (uint32_t m = 0; !err && m < set->marker_count; m++) {
		const struct marker *marker = &set->markers[m];

		if (is_wanted(marker))
			shots->points[shots->point_count++] =
				(struct seen_point){shots->shot_count, marker->label,
						    marker->camera_mask, marker->p_stage_m};
	}
	return err;
}

int marker_shots_add(struct marker_shots *shots, const struct shot *shot,
		     const struct marker_set *set)
{
	int err = add_points(shots, set);

	for (uint32_t c = 0; !err && c < shot->camera_count; c++)
		if (shot->sets[c])
			err = add_spots(shots, c, shot->sets[c]);
	if (!err)
		shots->shot_count++;
	return err;
}

void marker_shots_finish(struct marker_shots *shots)
{
	free(shots->spots);
	free(shots->points);
	memset(shots, 0, sizeof(*shots));
}
