/*
 * What the exit codes mean, in words, and which errno is which.
 */
#include "base/exit_codes.h"

#include <errno.h>

static const struct {
	enum exit_code code;
	const char *meaning;
} meanings[] = {
	{EXIT_CODE_OK, "done"},
	{EXIT_CODE_INTERNAL, "failed inside (out of memory, cannot write)"},
	{EXIT_CODE_USAGE, "wrong usage"},
	{EXIT_CODE_BAD_INPUT, "bad config, rig, layout or recording"},
	{EXIT_CODE_DEVICE, "a device is missing, busy or not what it should be"},
	{EXIT_CODE_CONNECTION, "no station answers, or the connection broke"},
	{EXIT_CODE_INCOMPLETE, "ended before all that was asked for had come"},
	{EXIT_CODE_RUNNING, "a station is already running here, or in a state that forbids it"},
	{EXIT_CODE_PERMISSION, "not permitted: the caller is not in the group that it takes"},
};

void exit_codes_print(FILE *out)
{
	fputs("Exit codes:\n", out);
	for (size_t i = 0; i < sizeof(meanings) / sizeof(meanings[0]); i++)
		fprintf(out, "  %d  %s\n", meanings[i].code, meanings[i].meaning);
}

enum exit_code exit_code_of(int error, enum exit_code otherwise)
{
	switch (error) {
	case 0:
		return EXIT_CODE_OK;
	case -ENOMEM:
		return EXIT_CODE_INTERNAL;
	case -ENODEV:
	case -ENXIO:
	case -EBUSY:
	case -ETIMEDOUT:
		return EXIT_CODE_DEVICE;
	case -EADDRINUSE:
		return EXIT_CODE_RUNNING;
	default:
		return otherwise;
	}
}
