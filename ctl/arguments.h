/*
 * The command line of a verb: one table of options gives the parsing and the --help text.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "ctl/verb.h"

#define DEFAULT_SOCKET_DIR "/run/stage"

#define COUNT_MAX INT32_MAX
#define NUMBER_MAX 1e6

/* Exactly one of the four pointers is set; it holds the default before parsing. A text is not
 * empty. */
struct argument {
	const char *name;       /* without the dashes */
	const char *value_name; /* NULL for a flag */
	const char *help;
	bool *flag;
	const char **text;
	uint64_t *count; /* up to COUNT_MAX, or count_max when that is set */
	double *number;  /* > 0, up to NUMBER_MAX */
	uint64_t count_max;
};

/* Rows that most verbs have. */
#define ARGUMENT_SOCKET_DIR(at)                                                         \
	{                                                                               \
		"socket-dir", "DIR", "of the station (default " DEFAULT_SOCKET_DIR ")", \
			.text = (at)                                                    \
	}
#define ARGUMENT_JSON(at)                                           \
	{                                                           \
		"json", NULL, "print one JSON object", .flag = (at) \
	}

enum arguments_result {
	ARGUMENTS_OK,
	ARGUMENTS_HELP,  /* --help was printed: exit with 0 */
	ARGUMENTS_WRONG, /* a message was printed: exit with EXIT_CODE_USAGE */
};

/* `arguments` ends with a row without name. Takes exactly `positional_count` words that are no
 * options into `positional`. */
enum arguments_result arguments_parse(const struct verb *verb, const struct argument *arguments,
				      int argc, char **argv, const char **positional,
				      int positional_count);

/* The same of a verb that takes one word or none: then *positional keeps what it was. */
enum arguments_result arguments_parse_optional(const struct verb *verb,
					       const struct argument *arguments, int argc,
					       char **argv, const char **positional);

/* What to return from a verb after anything but ARGUMENTS_OK. */
int arguments_exit_code(enum arguments_result result);
