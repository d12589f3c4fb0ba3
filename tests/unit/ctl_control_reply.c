/*
 * Replies that no station of ours would give.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/exit_codes.h"
#include "ctl/control_reply.h"

static char told[4096]; /* on stderr, by unpack() */

static int unpack(json_t **out, const char *text)
{
	bool continues;
	int pipe_fds[2], before = dup(STDERR_FILENO);

	assert_int_equal(pipe(pipe_fds), 0);
	dup2(pipe_fds[1], STDERR_FILENO);
	int code = control_reply_unpack(out, &continues, text);
	fflush(stderr);
	dup2(before, STDERR_FILENO);
	close(pipe_fds[1]);
	ssize_t length = read(pipe_fds[0], told, sizeof(told) - 1);
	told[length > 0 ? length : 0] = '\0';
	close(pipe_fds[0]);
	close(before);
	return code;
}

static void what_a_terminal_obeys_is_told_as_text(void **state)
{
	json_t *reply;

	(void)state;
	assert_int_equal(unpack(&reply,
				"{\"error\":\"org.stage.Control.Failed\",\"parameters\":"
				"{\"exit_code\":4,\"messages\":[\"a\\u001b[2J\\u009B\\n\\\\b"
				"\x7f\xc2\x9b\",7]}}"),
			 EXIT_CODE_DEVICE);
	assert_string_equal(told, "stagectl: a\\u001b[2J\\u009B\\n\\b??\nstagectl: ?\n");
}

static void texts_of_a_reply_keep_their_letters(void **state)
{
	json_t *reply;

	(void)state;
	assert_int_equal(
		unpack(&reply, "{\"parameters\":{\"state\":\"\\u00e9\\\\n\\\"\xc3\xa9\"}}"),
		EXIT_CODE_OK);
	assert_string_equal(control_reply_text(reply, "state"), "\xc3\xa9\\n\"\xc3\xa9");
	assert_null(control_reply_text(reply, "rig_revision"));
	json_decref(reply);
}

static void errors_without_their_details_are_told_all_the_same(void **state)
{
	static const struct {
		const char *error, *word;
		int code;
	} rows[] = {
		{"Failed", "log", EXIT_CODE_INTERNAL},
		{"WrongState", "?", EXIT_CODE_RUNNING},
		{"TooMany", "no more", EXIT_CODE_RUNNING},
		{"NoFrame", "?", EXIT_CODE_DEVICE},
		{"NoSuchCamera", "none", EXIT_CODE_DEVICE},
		{"PermissionDenied", "group ?", EXIT_CODE_PERMISSION},
		{"Unheard", "Unheard", EXIT_CODE_DEVICE},
	};
	char text[128];
	json_t *reply;

	(void)state;
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		snprintf(text, sizeof(text), "{\"error\":\"org.stage.Control.%s\"}", rows[i].error);
		assert_int_equal(unpack(&reply, text), rows[i].code);
		assert_non_null(strstr(told, rows[i].word));
		assert_null(strstr(told, "(null)"));
	}
}

static void what_is_no_reply_is_told(void **state)
{
	static const char *const texts[] = {"",      "{",          "[]", "7", "{\"parameters\":7}",
					    "\\u00", "{\"a\":\"\\"};
	json_t *reply;

	(void)state;
	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
		assert_int_equal(unpack(&reply, texts[i]), EXIT_CODE_CONNECTION);
		assert_non_null(strstr(told, "no station"));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_a_terminal_obeys_is_told_as_text),
		cmocka_unit_test(texts_of_a_reply_keep_their_letters),
		cmocka_unit_test(errors_without_their_details_are_told_all_the_same),
		cmocka_unit_test(what_is_no_reply_is_told),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
