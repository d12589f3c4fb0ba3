/*
 * How near the limits points are: `bench-points [--json] [--quick] [--seed N]`. Rigs, points and
 * noise are random; without --seed every run has its own, which is printed.
 */
#include "tests/bench/points.h"

#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"

static void print_lines(const json_t *figures)
{
	const char *key;
	json_t *value;

	json_object_foreach((json_t *)figures, key, value)
	{
		printf("%-34s ", key);
		json_dumpf(value, stdout, JSON_REAL_PRECISION(4) | JSON_ENCODE_ANY);
		putchar('\n');
	}
}

int main(int argc, char **argv)
{
	static const struct option options[] = {{"json", no_argument, NULL, 'j'},
						{"quick", no_argument, NULL, 'q'},
						{"seed", required_argument, NULL, 's'},
						{"help", no_argument, NULL, 'h'},
						{0}};
	struct points_bench bench = {(uint64_t)clock_now_ns() % 1000000007, 10, json_object()};
	bool json = false;
	int option;

	while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
		if (option == 'j')
			json = true;
		else if (option == 'q')
			bench.effort = 1;
		else if (option == 's')
			bench.seed = strtoull(optarg, NULL, 10);
		else {
			fprintf(stderr, "usage: bench-points [--json] [--quick] [--seed N]\n");
			return option == 'h' ? 0 : 2;
		}
	}
	json_object_set_new(bench.figures, "points_seed", json_integer((json_int_t)bench.seed));
	bench_fixes(&bench);
	bench_solve(&bench);
	bench_still(&bench);
	if (json) {
		json_dumpf(bench.figures, stdout, JSON_REAL_PRECISION(5));
		putchar('\n');
	} else {
		print_lines(bench.figures);
	}
	json_decref(bench.figures);
	return 0;
}
