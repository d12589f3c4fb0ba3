/*
 * How fast and how well spots are found: `bench-blobs [--json] [--quick] [--seed N] [--spots N]
 * [--diameter PX]`. Spots and noise are random; without --seed every run has its own, which is
 * printed.
 */
#include "tests/bench/blobs.h"

#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "tests/bench/figures.h"

static int usage(int status)
{
	fputs("usage: bench-blobs [--json] [--quick] [--seed N] [--spots N] [--diameter PX]\n",
	      stderr);
	return status;
}

static bool parse(int argc, char **argv, struct blobs_bench *bench, bool *json, int *status)
{
	static const struct option options[] = {{"json", no_argument, NULL, 'j'},
						{"quick", no_argument, NULL, 'q'},
						{"seed", required_argument, NULL, 's'},
						{"spots", required_argument, NULL, 'n'},
						{"help", no_argument, NULL, 'h'},
						{"diameter", required_argument, NULL, 'd'},
						{0}};
	int option;

	while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
		if (option == 'j')
			*json = true;
		else if (option == 'q')
			bench->effort = 1;
		else if (option == 's')
			bench->seed = strtoull(optarg, NULL, 10);
		else if (option == 'n')
			bench->spot_count = atoi(optarg);
		else if (option == 'd')
			bench->diameter_px = atof(optarg);
		else {
			*status = usage(option == 'h' ? 0 : 2);
			return false;
		}
	}
	return true;
}

int main(int argc, char **argv)
{
	struct blobs_bench bench = {(uint64_t)clock_now_ns() % 1000000007, 3, 110, 3,
				    json_object()};
	bool json = false;
	int status = 0;

	if (!parse(argc, argv, &bench, &json, &status)) {
		json_decref(bench.figures);
		return status;
	}
	json_object_set_new(bench.figures, "blobs_seed", json_integer((json_int_t)bench.seed));
	status = bench_times(&bench);
	if (status)
		fprintf(stderr, "bench-blobs: %s\n", strerror(-status));
	bench_centroids(&bench);
	print_figures(bench.figures, json);
	return status != 0;
}
