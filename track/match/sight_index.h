/*
 * Finding the blobs of one camera by place: strips over the image, filled once per shot.
 */
#pragma once

#include <stdbool.h>

#include "track/match/match.h"

void sight_index_build(struct sight_index *index, const struct view *view, const struct blob *blobs,
		       int blob_count);

/* Lists the blobs that are still free: few, once the seeds are matched. */
void sight_index_list_free(struct sight_index *index);

/* Fills in their rays. */
void sight_index_aim_free(struct sight_index *index);

/* Takes those off the list that were claimed since. */
void sight_index_trim_free(struct sight_index *index);

/* The free blob nearest to a pixel within `radius_px`, or BLOB_NONE. */
int sight_index_nearest(const struct sight_index *index, const double pixel[2], double radius_px);

/* The same before any is claimed, by the seeds; `*alone` turns false when there is another one
 * within `alone_px`, which is no less than the radius. */
int sight_index_nearest_alone(const struct sight_index *index, const double pixel[2],
			      double radius_px, double alone_px, bool *alone);

/* Up to `max` free blobs within the radius, by strips; returns how many. */
int sight_index_within(const struct sight_index *index, const double pixel[2], double radius_px,
		       int16_t *out, int max);
