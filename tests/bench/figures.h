/*
 * How a bench tells its figures.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

/* As one JSON object or one figure a line. Takes the object. */
void print_figures(json_t *figures, bool json);
