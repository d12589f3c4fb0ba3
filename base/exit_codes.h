/*
 * The exit codes of staged and stagectl, one table for both; --help prints it.
 */
#pragma once

#include <stdio.h>

enum exit_code {
	EXIT_CODE_OK = 0,
	EXIT_CODE_INTERNAL = 1,
	EXIT_CODE_USAGE = 2,
	EXIT_CODE_BAD_INPUT = 3,
	EXIT_CODE_DEVICE = 4,
	EXIT_CODE_CONNECTION = 5,
	EXIT_CODE_INCOMPLETE = 6,
	EXIT_CODE_RUNNING = 7,
	EXIT_CODE_PERMISSION = 8,
};

void exit_codes_print(FILE *out);

/* The code for a negative errno of loading files or opening devices; `otherwise` for those that
 * say nothing about it. */
enum exit_code exit_code_of(int error, enum exit_code otherwise);
