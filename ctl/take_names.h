/*
 * Do the spots of a take become markers with names? Else it is said, with what it likely comes
 * from: a take without one name is complete as far as its shots go.
 */
#pragma once

#include <jansson.h>
#include <stdio.h>

#include "config/stage.h"
#include "track/naming_check.h"

/* Zero it, but for the stage. */
struct take_names {
	const struct stage *stage; /* borrowed */
	struct naming_check check;
	uint32_t blocks, unnamed, most_in_a_row;
	/* of the newest block that was not fine */
	enum naming naming;
	struct naming_means means;
};

void take_names_step(struct take_names *names, const struct shot *shot,
		     const struct marker_set *set);

/* One line, or none when all is well. */
void take_names_print(const struct take_names *names, FILE *out);

/* {"seconds", "spots", "points", "named", "remedy"}, null when all is well; a new reference. */
json_t *take_names_json(const struct take_names *names);
