/*
 * Observations on disk: what is read is what was written, and whatever is wrong has its line.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/file.h"
#include "calib/board/observations_file.h"
#include "calib_wave.h"
#include "one_file.h"

static void what_is_read_is_what_was_written(void **state)
{
	(void)state;
	const struct wave wave = {
		.ir_count = 4,
		.pose_count = 12,
		.board = {.squares_x = 6, .squares_y = 5, .square_m = 0.06, .tag_part = 0.7},
		.noise_px = 0.1,
		.lost_part = 0.1,
		.seed = 4};
	char hash[2][OBSERVATIONS_HASH_BYTES];
	struct observations read;
	struct waved waved;

	wave_make(&waved, &wave);
	assert_int_equal(observations_write(&waved.observations, path, NULL), 0);
	assert_int_equal(observations_read(&read, path, NULL), 0);
	observations_hash(&waved.observations, hash[0]);
	observations_hash(&read, hash[1]);
	assert_string_equal(hash[0], hash[1]);
	assert_int_equal(read.view_count, waved.observations.view_count);
	for (uint32_t v = 0; v < read.view_count; v++)
		assert_int_equal(read.views[v].seen_count, waved.observations.views[v].seen_count);
	observations_finish(&read);
	wave_finish(&waved);
}

#define BOARD_LINE "# stage-board 4 4 0.05 0.7 0\n"
#define HEADING BOARD_LINE "# stage-camera ir0 640 480\n"
#define EIGHT                                                                \
	"ir0-000001.png 1 1 0\nir0-000001.png 2 1 0\nir0-000001.png 3 1 0\n" \
	"ir0-000001.png 1 2 0\nir0-000001.png 2 2 0\nir0-000001.png - - -\n" \
	"ir0-000001.png 1 3 0\nir0-000001.png 2 3 0\n"
#define NINE EIGHT "ir0-000001.png 3 3 0\n"

static void whatever_is_wrong_has_its_line(void **state)
{
	(void)state;
	const struct {
		const char *text, *words;
	} cases[] = {
		{"", "no view in it"},
		{NINE, ":1: a view before"},
		{"# stage-board 4 4 x\n", ":1: expected squares_x"},
		{BOARD_LINE BOARD_LINE, ":2: a second board"},
		{"# stage-board 4 400 0.05 0.7 0\n# stage-camera ir0 640 480\n" NINE,
		 "squares_y: 400 is outside"},
		{BOARD_LINE "# stage-camera ../x 640 480\n", ":2: expected a camera's name"},
		{HEADING "# stage-camera ir0 640 480\n" NINE, "camera ir0 is listed twice"},
		{HEADING NINE "# stage-camera ir1 640 480\n",
		 ":12: a camera behind the first view"},
		{HEADING "ir0-000001.png 1 1\n", ":3: expected a file's name, x, y and level"},
		{HEADING "ir0-000001.png 1 nan 0\n", ":3: \"1\", \"nan\": not numbers"},
		{HEADING "ir7-000001.png 1 1 0\n", ":3: ir7-000001.png: no such camera"},
		{HEADING "ir0.png 1 1 0\n", ":3: ir0.png: expected CAMERA-NUMBER.png"},
		{HEADING EIGHT "ir0-000002.png 1 1 0\n",
		 ":11: ir0-000001.png has 8 corners and the board 9"},
		{HEADING EIGHT, ":10: ir0-000001.png: the file ends within it"},
		{HEADING NINE NINE, ":20: ir0-000001.png: a second time"},
		{HEADING EIGHT "ir0-000001.png 640 3 0\n", ":11: ir0-000001.png: a corner outside"},
	};

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		struct observations read;
		struct diag diag = {0};

		write_file(cases[i].text, strlen(cases[i].text));
		assert_int_equal(observations_read(&read, path, &diag), -EINVAL);
		if (!strstr(diag.text, cases[i].words))
			fail_msg("not \"%s\" but %s", cases[i].words, diag.text);
		diag_finish(&diag);
	}
}

static void any_byte_may_be_spoilt(void **state)
{
	(void)state;
	char text[] = HEADING NINE;
	struct rng rng;

	rng_init(&rng, 1, 1);
	for (int round = 0; round < 2000; round++) {
		char spoilt[sizeof(text)];
		struct observations read;

		memcpy(spoilt, text, sizeof(text));
		for (int i = 0; i < 3; i++)
			spoilt[rng_u32(&rng) % (sizeof(text) - 1)] = (char)rng_u32(&rng);
		write_file(spoilt, sizeof(text) - 1);
		if (!observations_read(&read, path, NULL)) {
			assert_in_range(read.view_count, 1, 9);
			observations_finish(&read);
		}
	}
}

static void a_file_that_is_not_there_is_named(void **state)
{
	(void)state;
	struct observations read;
	struct diag diag = {0};

	assert_int_equal(observations_read(&read, "/nowhere/corners.vnl", &diag), -ENOENT);
	assert_non_null(strstr(diag.text, "/nowhere/corners.vnl: "));
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_read_is_what_was_written),
		cmocka_unit_test(whatever_is_wrong_has_its_line),
		cmocka_unit_test(any_byte_may_be_spoilt),
		cmocka_unit_test(a_file_that_is_not_there_is_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
