/*
 * What goes to the journal, and what to standard error. The library's call is replaced by one that
 * keeps the entry.
 */
#include "daemon/journal.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/log.h"

int sd_journal_sendv(const struct iovec *fields, int count);

static char entry[4096]; /* the fields of the last one, a line each */
static int journal_error;

int sd_journal_sendv(const struct iovec *fields, int count)
{
	entry[0] = '\0';
	for (int i = 0; i < count && !journal_error; i++) {
		strncat(entry, fields[i].iov_base, fields[i].iov_len);
		strcat(entry, "\n");
	}
	return journal_error;
}

static int saved_stderr, pipe_end;

/* Standard error is a pipe, which JOURNAL_STREAM names or not. */
static void begin(bool journal)
{
	char stream[64];
	struct stat st;
	int ends[2];

	assert_int_equal(pipe(ends), 0);
	saved_stderr = dup(STDERR_FILENO);
	dup2(ends[1], STDERR_FILENO);
	close(ends[1]);
	pipe_end = ends[0];
	assert_int_equal(fstat(STDERR_FILENO, &st), 0);
	snprintf(stream, sizeof(stream), "%llu:%llu", (unsigned long long)st.st_dev,
		 (unsigned long long)st.st_ino + !journal);
	setenv("JOURNAL_STREAM", stream, 1);
	entry[0] = '\0';
	journal_begin();
}

/* What came on standard error meanwhile. */
static const char *end(void)
{
	static char said[4096];

	dup2(saved_stderr, STDERR_FILENO);
	close(saved_stderr);
	ssize_t got = read(pipe_end, said, sizeof(said) - 1);
	said[got < 0 ? 0 : got] = '\0';
	close(pipe_end);
	return said;
}

static void a_line_about_a_camera_and_a_shot_has_both_as_fields(void **state)
{
	(void)state;
	begin(true);
	log_about(LOG_LEVEL_WARNING, &(struct log_fields){"ir3", 4711}, "camera %s: lost", "ir3");
	assert_string_equal(end(), "");
	assert_string_equal(entry, "MESSAGE=camera ir3: lost\nPRIORITY=4\nSTAGE_CAMERA=ir3\n"
				   "STAGE_SHOT=4711\n");
}

static void a_line_about_nothing_has_no_such_fields(void **state)
{
	(void)state;
	begin(true);
	log_info("running");
	assert_string_equal(end(), "");
	assert_string_equal(entry, "MESSAGE=running\nPRIORITY=6\n");
}

static void elsewhere_the_same_words_are_printed(void **state)
{
	(void)state;
	begin(false);
	log_about(LOG_LEVEL_WARNING, &(struct log_fields){"ir3", 4711}, "camera %s: lost", "ir3");
	assert_string_equal(end(), "camera ir3: lost\n");
	assert_string_equal(entry, "");
}

static void a_journal_that_does_not_take_a_line_gets_it_printed(void **state)
{
	(void)state;
	begin(true);
	journal_error = -ENOENT;
	log_error("a trigger is gone");
	journal_error = 0;
	assert_string_equal(end(), "<3>a trigger is gone\n");
}

static void a_line_that_is_too_long_is_cut(void **state)
{
	char text[3000];

	(void)state;
	memset(text, 'x', sizeof(text) - 1);
	text[sizeof(text) - 1] = '\0';
	begin(true);
	log_info("%s", text);
	assert_string_equal(end(), "");
	assert_non_null(strstr(entry, "PRIORITY=6"));
	assert_int_equal(strspn(entry + strlen("MESSAGE="), "x"), 1023);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_line_about_a_camera_and_a_shot_has_both_as_fields),
		cmocka_unit_test(a_line_about_nothing_has_no_such_fields),
		cmocka_unit_test(elsewhere_the_same_words_are_printed),
		cmocka_unit_test(a_journal_that_does_not_take_a_line_gets_it_printed),
		cmocka_unit_test(a_line_that_is_too_long_is_cut),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
