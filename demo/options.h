/*
 * The command line of stage-demo.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

struct demo_options {
	double seconds;
	bool json;
	bool sim;          /* cameras inside the station, instead of GigE Vision ones */
	bool stress;       /* under fire, with sim */
	bool calibrate;    /* the station gets its rig first, with sim */
	uint32_t hd_count; /* HD cameras beside them, only with sim */
	const char *scene;
	uint64_t seed;
	const char *keep_dir; /* NULL: a temporary directory, removed at the end */
};

/* Ends the program with a message when the command line is wrong, or after --help. */
struct demo_options demo_options_parse(int argc, char **argv);
