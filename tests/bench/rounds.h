/*
 * The arguments of a bench that goes round after round.
 */
#pragma once

#include <stdbool.h>

struct bench_rounds {
	int count;
	bool json;
};

/* Of the program `name`. Returns -1, or the exit code of a program that ends here: after --help, or
 * an argument that it does not know, or a count that is not 1 to `max`. */
int parse_rounds(int argc, char **argv, const char *name, int max, struct bench_rounds *rounds);
