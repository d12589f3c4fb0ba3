/*
 * A file under its name is whole, or it is the one from before.
 */
#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/output_file.h"

#define DISK_BYTES 4096

static char dir[32], path[64], other[64];

static void write_text(const char *file_path, const char *text)
{
	FILE *file = fopen(file_path, "w");

	assert_non_null(file);
	fputs(text, file);
	fclose(file);
}

static void assert_text(const char *file_path, const char *text)
{
	char found[64] = "";
	FILE *file = fopen(file_path, "r");

	assert_non_null(file);
	assert_non_null(fgets(found, sizeof(found), file));
	fclose(file);
	assert_string_equal(found, text);
}

static int set_up(void **state)
{
	(void)state;
	strcpy(dir, "/tmp/base-output-XXXXXX");
	if (!mkdtemp(dir))
		return -1;
	snprintf(path, sizeof(path), "%s/file", dir);
	snprintf(other, sizeof(other), "%s/file.new", dir);
	write_text(path, "before");
	write_text(other, "the user's");
	return 0;
}

/* Fails where something else was left. */
static int tear_down(void **state)
{
	(void)state;
	return unlink(path) || unlink(other) || rmdir(dir);
}

static void a_committed_file_takes_its_place_alone(void **state)
{
	struct output_file file;

	(void)state;
	assert_int_equal(output_file_open(&file, path, NULL), 0);
	fputs("after", file.stream);
	assert_text(path, "before");
	assert_int_equal(output_file_commit(&file, NULL), 0);
	assert_text(path, "after");
	assert_text(other, "the user's");
}

static void a_file_that_could_not_be_written_is_not_there(void **state)
{
	struct output_file file;
	struct diag diag = {0};

	(void)state;
	assert_int_equal(output_file_open(&file, path, NULL), 0);
	fputs("half", file.stream);
	assert_int_equal(output_file_end(&file, -ENOMEM, &diag), -ENOMEM);
	assert_non_null(strstr(diag.text, path));
	assert_text(path, "before");
	diag_finish(&diag);
}

/* The limit of a file's size stands for that of the disk. */
static void a_full_disk_leaves_the_file_from_before(void **state)
{
	struct rlimit before, small;
	struct output_file file;
	int err = 0;

	(void)state;
	signal(SIGXFSZ, SIG_IGN);
	getrlimit(RLIMIT_FSIZE, &before);
	small = (struct rlimit){DISK_BYTES, before.rlim_max};
	setrlimit(RLIMIT_FSIZE, &small);
	assert_int_equal(output_file_open(&file, path, NULL), 0);
	for (int i = 0; i < 3 * DISK_BYTES; i++)
		fputc('x', file.stream);
	err = output_file_commit(&file, NULL);
	setrlimit(RLIMIT_FSIZE, &before);
	assert_true(err < 0);
	assert_text(path, "before");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_committed_file_takes_its_place_alone, set_up,
						tear_down),
		cmocka_unit_test_setup_teardown(a_file_that_could_not_be_written_is_not_there,
						set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_full_disk_leaves_the_file_from_before, set_up,
						tear_down),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
