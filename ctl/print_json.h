/*
 * What --json prints.
 */
#pragma once

#include <jansson.h>

/* One line on standard output. Takes the object. */
void print_json(json_t *object);
