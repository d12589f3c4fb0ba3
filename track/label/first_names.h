/*
 * Names from nothing: a face that is found while its mouth is open can be read one row of markers
 * aside, and such a reading agrees with itself. What it cannot do is come out even: it leaves a
 * label without a point at one end, and a point without a label at the other. Pure and real-time
 * safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"

enum reading {
	READING_WHOLE,  /* every point and every label nearby is accounted for, and its neighbours
			   are all there */
	READING_EVEN,   /* nearly every point and every label nearby is accounted for */
	READING_UNEVEN, /* labels without a point, or points without a label: the other end may be
			   hidden */
	READING_SHIFTED /* both: it may be read aside */
};

/* What a shot leaves over, of all frames. */
struct leftovers {
	uint32_t label_count, point_count;
	bool is_lonely[LABEL_MAX];        /* the same labels */
	int16_t labels[LABEL_MAX];        /* that should be seen and have no point */
	struct vec3 p_stage_m[POINT_MAX]; /* points of no label, known ghosts left out */
	bool rests[ACTOR_MAX]; /* nearly all skin of this face lies as in the neutral one: no part
				  of it is read aside, whatever is left over */
};

/* Once per shot, after the points are labelled. */
void first_names_look(const struct tracker_state *state, const struct labelling *l,
		      const struct point *points, struct leftovers *out);

/* How the reading about a seen label comes out. */
enum reading first_names_read(const struct tracker_state *state, const struct labelling *l,
			      const struct leftovers *leftovers, uint32_t label);

/* Nearly all about the label that is seen or should be had its name a moment ago: it cannot be read
 * aside. */
bool first_names_enclosed(const struct tracker_state *state, const struct labelling *l,
			  const struct leftovers *leftovers, uint32_t label);
