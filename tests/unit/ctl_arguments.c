/*
 * What the options of a verb take for a number.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "ctl/arguments.h"

static const struct verb verb = {.name = "try", .arguments = "", .summary = "Tries"};

struct given {
	uint64_t count, seed;
	double number;
	const char *text;
};

static enum arguments_result parse(struct given *given, const char *word)
{
	char *argv[] = {(char *)"try", (char *)word, NULL};
	const struct argument arguments[] = {
		{"count", "N", "", .count = &given->count},
		{"seed", "N", "", .count = &given->seed, .count_max = UINT64_MAX},
		{"number", "X", "", .number = &given->number},
		{"text", "T", "", .text = &given->text},
		{0},
	};

	return arguments_parse(&verb, arguments, 2, argv, NULL, 0);
}

static void what_is_a_number_in_bounds_is_taken(void **state)
{
	struct given given = {0};

	(void)state;
	assert_int_equal(parse(&given, "--count=2147483647"), ARGUMENTS_OK);
	assert_int_equal(given.count, INT32_MAX);
	assert_int_equal(parse(&given, "--count=0"), ARGUMENTS_OK);
	assert_int_equal(given.count, 0);
	assert_int_equal(parse(&given, "--seed=18446744073709551615"), ARGUMENTS_OK);
	assert_int_equal(given.seed, UINT64_MAX);
	assert_int_equal(parse(&given, "--number=2.5e-1"), ARGUMENTS_OK);
	assert_float_equal(given.number, 0.25, 0);
}

static void whatever_else_is_refused_and_changes_nothing(void **state)
{
	static const char *const words[] = {
		"--count=-5",       "--count= -5",        "--count= 5",
		"--count=+5",       "--count=5x",         "--count=",
		"--count=1e3",      "--count=2147483648", "--count=3000000000",
		"--seed=-1",        "--number=1e300",     "--number=0",
		"--number=-1",      "--number=inf",       "--number= 1",
		"--number=nan",     "--number=",          "--text=",
		"--number=1000001", "--number=0x10",      "--seed=18446744073709551616",
	};
	struct given given = {.count = 3, .seed = 4, .number = 5, .text = "six"};

	(void)state;
	for (size_t i = 0; i < sizeof(words) / sizeof(words[0]); i++)
		if (parse(&given, words[i]) != ARGUMENTS_WRONG)
			fail_msg("'%s' was taken", words[i]);
	assert_int_equal(given.count, 3);
	assert_int_equal(given.seed, 4);
	assert_float_equal(given.number, 5, 0);
	assert_string_equal(given.text, "six");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_a_number_in_bounds_is_taken),
		cmocka_unit_test(whatever_else_is_refused_and_changes_nothing),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
