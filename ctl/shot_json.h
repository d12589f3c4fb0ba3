/*
 * A marker set as one line of JSON, the same bytes for the same numbers everywhere.
 */
#pragma once

#include <stdio.h>

#include "track/layout.h"
#include "track/observe.h"

/* Writes the object and a newline; errors show in ferror(). */
void shot_json_write(FILE *out, const struct marker_set *set, const struct layout *layout);
