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
#include "tests/bench/figures.h"

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
	print_figures(bench.figures, json);
	return 0;
}
