/*
 * getopt_long over a verb's table.
 */
#include "ctl/arguments.h"

#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/exit_codes.h"

#define ARGUMENT_MAX 16
#define HELP_OPTION 1000

static void print_help(const struct verb *verb, const struct argument *arguments)
{
	printf("Usage: stagectl %s%s%s [options]\n%s.\n\nOptions:\n", verb->name,
	       verb->arguments[0] ? " " : "", verb->arguments, verb->summary);
	for (const struct argument *a = arguments; a->name; a++) {
		char left[64];

		snprintf(left, sizeof(left), "--%s%s%s", a->name, a->value_name ? " " : "",
			 a->value_name ? a->value_name : "");
		printf("  %-20s %s\n", left, a->help);
	}
	printf("  %-20s %s\n\n", "--help", "this text");
	exit_codes_print(stdout);
}

static bool set_count(const struct argument *argument, const char *text)
{
	uint64_t most = argument->count_max ? argument->count_max : COUNT_MAX;
	char *end;

	errno = 0;
	unsigned long long value = strtoull(text, &end, 10);
	if (!errno && text[0] >= '0' && text[0] <= '9' && !*end && value <= most) {
		*argument->count = value;
		return true;
	}
	fprintf(stderr, "stagectl: --%s %s: must be a whole number, 0 to %" PRIu64 "\n",
		argument->name, text, most);
	return false;
}

static bool set_number(const struct argument *argument, const char *text)
{
	char *end;
	double value = strtod(text, &end);

	if (!text[strspn(text, "0123456789.eE+-")] && !*end && end != text && value > 0 &&
	    value <= NUMBER_MAX) {
		*argument->number = value;
		return true;
	}
	fprintf(stderr, "stagectl: --%s %s: must be a number greater than 0, up to %.0f\n",
		argument->name, text, NUMBER_MAX);
	return false;
}

static bool set_text(const struct argument *argument, const char *text)
{
	if (text[0])
		*argument->text = text;
	else
		fprintf(stderr, "stagectl: --%s: must not be empty\n", argument->name);
	return text[0];
}

static bool set_argument(const struct argument *argument, const char *text)
{
	if (argument->text)
		return set_text(argument, text);
	if (argument->count)
		return set_count(argument, text);
	if (argument->number)
		return set_number(argument, text);
	*argument->flag = true;
	return true;
}

static enum arguments_result wrong(const struct verb *verb)
{
	fprintf(stderr, "usage: stagectl %s%s%s [options]; see stagectl %s --help\n", verb->name,
		verb->arguments[0] ? " " : "", verb->arguments, verb->name);
	return ARGUMENTS_WRONG;
}

static enum arguments_result parse_options(const struct verb *verb,
					   const struct argument *arguments, int argc, char **argv)
{
	struct option options[ARGUMENT_MAX + 2] = {0};
	int count = 0, chosen;

	for (; arguments[count].name && count < ARGUMENT_MAX; count++)
		options[count] = (struct option){arguments[count].name,
						 arguments[count].value_name != NULL, NULL, count};
	options[count] = (struct option){"help", 0, NULL, HELP_OPTION};
	optind = 0;
	argv[0] = (char *)"stagectl"; /* whom getopt's own messages name */
	while ((chosen = getopt_long(argc, argv, "h", options, NULL)) != -1) {
		if (chosen == HELP_OPTION || chosen == 'h') {
			print_help(verb, arguments);
			return ARGUMENTS_HELP;
		}
		if (chosen == '?' || !set_argument(&arguments[chosen], optarg))
			return wrong(verb);
	}
	return ARGUMENTS_OK;
}

enum arguments_result arguments_parse(const struct verb *verb, const struct argument *arguments,
				      int argc, char **argv, const char **positional,
				      int positional_count)
{
	enum arguments_result result = parse_options(verb, arguments, argc, argv);

	if (result != ARGUMENTS_OK)
		return result;
	if (argc - optind != positional_count)
		return wrong(verb);
	for (int i = 0; i < positional_count; i++)
		positional[i] = argv[optind + i];
	return ARGUMENTS_OK;
}

enum arguments_result arguments_parse_optional(const struct verb *verb,
					       const struct argument *arguments, int argc,
					       char **argv, const char **positional)
{
	enum arguments_result result = parse_options(verb, arguments, argc, argv);

	if (result == ARGUMENTS_OK && argc - optind > 1)
		return wrong(verb);
	if (result == ARGUMENTS_OK && argc > optind)
		*positional = argv[optind];
	return result;
}

int arguments_exit_code(enum arguments_result result)
{
	return result == ARGUMENTS_WRONG ? EXIT_CODE_USAGE : EXIT_CODE_OK;
}
