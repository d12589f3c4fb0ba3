#include "tests/bench/rounds.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>

int parse_rounds(int argc, char **argv, const char *name, int max, struct bench_rounds *rounds)
{
	static const struct option options[] = {{"json", no_argument, NULL, 'j'},
						{"rounds", required_argument, NULL, 'r'},
						{"help", no_argument, NULL, 'h'},
						{0}};
	int option;

	while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
		if (option == 'j')
			rounds->json = true;
		else if (option == 'r')
			rounds->count = atoi(optarg);
		else {
			fprintf(stderr, "usage: %s [--json] [--rounds N]\n", name);
			return option == 'h' ? 0 : 2;
		}
	}
	if (rounds->count >= 1 && rounds->count <= max)
		return -1;
	fprintf(stderr, "%s: --rounds is 1 to %d\n", name, max);
	return 2;
}
