/*
 * Names for points: all labels at once by optimal assignment around their predictions, corrected by
 * what the neighbours do, and no name at all where two readings are nearly as good. Pure and
 * real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/assign.h"
#include "track/layout.h"
#include "track/match.h"
#include "track/predict.h"
#include "track/tracker_state.h"

struct labelling {
	struct assign assign;
	struct predictions motion;            /* before anything of this shot was seen */
	struct predictions predictions;       /* with the neighbours' word */
	struct vec3 point_local_m[POINT_MAX]; /* head coordinates */
	bool point_usable[POINT_MAX];         /* three or more views */
	int16_t point_of_label[LABEL_MAX]; /* or -1; every one of them is sure enough to follow */
	bool doubtful[LABEL_MAX];          /* a point was near, but it may be another's */
	bool seen[LABEL_MAX];
	struct vec3 seen_m[LABEL_MAX]; /* head coordinates, where seen */
};

/* Assigns points to labels and fills predictions, point_of_label, seen and seen_m.
 * `motion` must be filled before. */
void label_points(struct labelling *labelling, const struct tracker_state *state,
		  const struct layout *layout, const struct point *points, uint32_t point_count,
		  const struct pose *rt_stage_head, int64_t now_ns);

/* Whether a label that has no name yet may be given it: its neighbours agree, and no unexplained
 * point nearby says that the whole neighbourhood may be read wrongly. */
bool label_is_clear(const struct labelling *labelling, const struct tracker_state *state,
		    const struct layout *layout, uint32_t point_count, uint32_t label);
