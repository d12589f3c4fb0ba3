/*
 * One object, one line.
 */
#include "ctl/print_json.h"

#include <stdio.h>

void print_json(json_t *object)
{
	json_dumpf(object, stdout, JSON_COMPACT | JSON_REAL_PRECISION(12));
	putchar('\n');
	json_decref(object);
}
