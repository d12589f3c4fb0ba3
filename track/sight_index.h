/*
 * Finding the blobs of one camera by place: a grid of cells over the image, filled once per shot.
 */
#pragma once

#include "track/match.h"

void sight_index_build(struct sight_index *index, const struct view *view,
		       const struct blob_set *set);

/* The rays of the blobs that are still free: few, once the seeds are matched. */
void sight_index_rays(struct sight_index *index);

/* The blob nearest to a pixel within `radius_px`, or BLOB_NONE. `free_only` passes over claimed
 * blobs. */
int sight_index_nearest(const struct sight_index *index, const double pixel[2], double radius_px,
			bool free_only);

/* Up to `max` free blobs within the radius, in index order; returns how many. */
int sight_index_within(const struct sight_index *index, const double pixel[2], double radius_px,
		       int16_t *out, int max);
