/*
 * Do the spots that cameras see become markers with names? Where hardly any does, for seconds, the
 * cameras are not the rig's (addresses swapped, a rig of another day) or the layout is another
 * actor's. Flat, pure, real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/tracker.h"

#define NAMING_BLOCK_NS INT64_C(250000000)

enum naming {
	NAMING_FINE,      /* or too few spots to tell */
	NAMING_NO_POINTS, /* spots of different cameras do not meet: nothing to name */
	NAMING_NO_NAMES,  /* they meet, and the points are no markers of the layout */
};

/* Means over a block. */
struct naming_means {
	double spots;  /* a picture, of the middle camera */
	double points; /* a shot, named or not */
	double named;  /* a shot: labels that were seen */
};

/* Zero it. */
struct naming_check {
	int64_t block_began_ns;
	uint32_t shots;
	struct naming_means sums;
	/* the answer, of the newest block */
	enum naming naming;
	struct naming_means means;
	uint32_t blocks_in_a_row; /* that were not fine, this one included */
};

/* True when there is an answer, once in NAMING_BLOCK_NS. */
bool naming_check_run(struct naming_check *check, const struct tracker_rig *rig,
		      const struct shot *shot, const struct marker_set *set);

/* What it likely comes from and what to do, in words for the operator; NULL when it is fine. */
const char *naming_remedy(enum naming naming);
