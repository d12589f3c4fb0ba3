/*
 * For bench.py, or for people.
 */
#include "tests/bench/figures.h"

#include <stdio.h>

static void print_lines(json_t *figures)
{
	const char *key;
	json_t *value;

	json_object_foreach(figures, key, value)
	{
		printf("%-42s ", key);
		json_dumpf(value, stdout, JSON_REAL_PRECISION(4) | JSON_ENCODE_ANY);
		putchar('\n');
	}
}

void print_figures(json_t *figures, bool json)
{
	if (json) {
		json_dumpf(figures, stdout, JSON_REAL_PRECISION(5));
		putchar('\n');
	} else {
		print_lines(figures);
	}
	json_decref(figures);
}
