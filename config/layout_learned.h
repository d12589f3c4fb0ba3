/*
 * The `learned` of a marker in an actor's file: what the calibration of the actor found out.
 */
#pragma once

#include "config/yaml.h"
#include "track/layout.h"

/* Neighbours as the file names them; a later marker may be one. */
struct learned_names {
	int count;
	char names[LEARNED_NEIGHBOUR_MAX][NAME_BYTES];
	struct yaml_place places[LEARNED_NEIGHBOUR_MAX];
};

/* Reads all but which markers the neighbours are: their names go into `names`. */
void learned_read(struct yaml *yaml, const struct yaml_value *value, struct layout_learned *out,
		  struct learned_names *names);

/* Finds the neighbours of marker `index` by their names once all markers are read. */
void learned_resolve(struct yaml *yaml, struct layout *layout, uint32_t index,
		     const struct learned_names *names);
