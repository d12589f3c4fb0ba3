/*
 * A case of cmocka that not every machine or user can run. Its own skip() tells "not ok ... #
 * SKIP", which readers of TAP count as failed; a case that passes may bear the directive in its
 * name.
 */
#ifndef TESTS_TAP_CASE_H
#define TESTS_TAP_CASE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>

#define unit_test_unless(cause, f) tap_case_unless(cause, #f, f)

static inline void tap_case_nothing(void **state)
{
	(void)state;
}

/* `cause` says in words why it cannot be run here; NULL: it can. The name is never freed. */
static inline struct CMUnitTest tap_case_unless(const char *cause, const char *name,
						CMUnitTestFunction f)
{
	char *told;

	if (!cause)
		return (struct CMUnitTest){.name = name, .test_func = f};
	if (asprintf(&told, "%s # SKIP %s", name, cause) < 0)
		abort();
	return (struct CMUnitTest){.name = told, .test_func = tap_case_nothing};
}

#endif
