/*
 * Layout files: short ones work, and what would mislead the tracker is refused by line.
 */
#include "config/layout_file.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "one_file.h"

#define FOUR                                       \
	"markers:\n"                               \
	"- {name: a, neutral_m: [0, 0, 0.1]}\n"    \
	"- {name: b, neutral_m: [0.01, 0, 0.1]}\n" \
	"- {name: c, neutral_m: [0, 0.02, 0.1]}\n" \
	"- {name: d, neutral_m: [0.03, 0.03, 0.1], group: band, rigid: true, diameter_m: 0.003}\n"

static struct layout layout;

static int load(const char *text, struct diag *diag)
{
	write_file(text, strlen(text));
	return layout_load(&layout, path, diag);
}

static void expect_messages(const char *text, const char *messages)
{
	struct diag diag = {0};

	assert_int_equal(load(text, &diag), -EINVAL);
	expect_lines(&diag, messages);
}

static void a_name_and_a_place_are_enough(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load(FOUR, &diag), 0);
	assert_null(diag.text);
	assert_string_equal(layout.actors[0].name, "");
	assert_int_equal(layout.marker_count, 4);
	assert_string_equal(layout.markers[1].name, "b");
	assert_string_equal(layout.markers[1].group, "");
	assert_false(layout.markers[1].rigid);
	assert_true(layout.markers[1].diameter_m == 0.0015);
	assert_true(layout.markers[1].neutral_m.x == 0.01 && layout.markers[1].neutral_m.z == 0.1);
	assert_string_equal(layout.markers[3].group, "band");
	assert_true(layout.markers[3].rigid);
	assert_true(layout.markers[3].diameter_m == 0.003);
	assert_int_equal(load(FOUR "actor: anna\n", &diag), 0);
	assert_string_equal(layout.actors[0].name, "anna");
	assert_int_equal(layout.actors[0].count, 4);
}

static void body_markers_name_their_segment(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load(FOUR "- {name: e, segment: chest, neutral_m: [0, -0.5, 0]}\n", &diag),
			 0);
	assert_string_equal(layout.markers[0].segment, "");
	assert_string_equal(layout.markers[4].segment, "chest");
	expect_messages(FOUR "- {name: e, segment: chest, rigid: true, neutral_m: [0, -0.5, 0]}\n",
			"6:36: markers[4].rigid: rigid is of markers on the skull; this one is of "
			"segment 'chest', which is rigid anyway: leave it out\n");
}

static void a_body_without_a_head_is_refused(void **state)
{
	(void)state;
	expect_messages("markers:\n"
			"- {name: a, segment: arm, neutral_m: [0.2, -0.3, 0]}\n"
			"- {name: b, segment: arm, neutral_m: [0.2, -0.4, 0]}\n"
			"- {name: c, segment: arm, neutral_m: [0.2, -0.5, 0.1]}\n"
			"- {name: d, neutral_m: [0, 0.1, 0.1]}\n",
			"2:4: markers: 1 markers on the head, which carries the body: it needs at "
			"least 3; put some on a head band, with rigid: true and without segment\n");
}

#define LEARNED                                                                  \
	"- {name: e, neutral_m: [0.02, 0, 0.1], mpeg4: 8.10, learned: {\n"       \
	"  range_min_m: [-0.01, -0.02, 0], range_max_m: [0.01, 0.005, 0.003],\n" \
	"  speed_max_m_s: 0.4, rest_sd_m: 0.00003, cov_m2: [1e-6, 0, 0, 2e-6, 0, 3e-6],\n"

static void what_was_learned_of_an_actor_is_read(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load("version: 1\ncalibrated: 2026-11-22\nactor: anna\n" FOUR LEARNED
			      "  neighbours: [{name: b, spread_m: 0.001}]}}\n",
			      &diag),
			 0);
	const struct layout_learned *l = &layout.markers[4].learned;
	assert_string_equal(layout.markers[4].mpeg4, "8.10");
	assert_true(l->known && !layout.markers[0].learned.known);
	assert_true(l->range_min_m.y == -0.02 && l->range_max_m.z == 0.003);
	assert_true(l->speed_max_m_s == 0.4 && l->rest_sd_m == 0.00003 && l->cov_m2[3] == 2e-6);
	assert_int_equal(l->neighbour_count, 1);
	assert_int_equal(l->neighbours[0].marker, 1);
	assert_true(l->neighbours[0].spread_m == 0.001);
}

static void what_cannot_have_been_learned_is_refused_by_line(void **state)
{
	(void)state;
	expect_messages(
		FOUR LEARNED "  neighbours: [{name: x, spread_m: 0.001}, {name: e, "
			     "spread_m: 0.001}]}}\n",
		"9:23: markers[4].learned.neighbours[0].name: 'x' is no marker of this file\n"
		"9:51: markers[4].learned.neighbours[1].name: 'e' is this very marker\n");
	expect_messages(FOUR "- {name: e, neutral_m: [0.02, 0, 0.1], mpeg4: 12.1}\n",
			"6:47: markers[4].mpeg4: '12.1' is no feature point of MPEG-4: those are "
			"2.1 to 11.6\n");
	expect_messages("version: 2\n" FOUR,
			"1:10: version: 2 is out of range, expected a whole number from 1 to 1\n");
}

static void expect_refusal(struct layout *all, const char *text, const char *message)
{
	struct diag diag = {0};

	assert_int_equal(load(text, &diag), 0);
	assert_int_equal(layout_join(all, &layout, "x.yaml", &diag), -EINVAL);
	assert_string_equal(diag.text, message);
	diag_finish(&diag);
}

static void actors_stand_behind_one_another(void **state)
{
	static struct layout all;

	(void)state;
	assert_int_equal(load(FOUR "actor: anna\n", NULL), 0);
	assert_int_equal(layout_join(&all, &layout, path, NULL), 0);
	assert_int_equal(load(FOUR "- {name: e, neutral_m: [0.5, 0, 0]}\nactor: ben\n", NULL), 0);
	assert_int_equal(layout_join(&all, &layout, path, NULL), 0);
	assert_int_equal(all.actor_count, 2);
	assert_int_equal(all.marker_count, 9);
	assert_string_equal(all.actors[1].name, "ben");
	assert_int_equal(all.actors[1].first, 4);
	assert_int_equal(all.actors[1].count, 5);
	assert_string_equal(all.markers[8].name, "e");
	expect_refusal(&all, FOUR "actor: anna\n",
		       "x.yaml: actor: an earlier layout has this name\n");
	expect_refusal(&all, FOUR,
		       "x.yaml: actor: missing here or in the first layout; each of several names "
		       "its own\n");
}

static void a_doubled_name_names_both_lines(void **state)
{
	(void)state;
	expect_messages(FOUR "- {name: b, neutral_m: [0.05, 0, 0]}\n",
			"6:10: markers[4].name: 'b' is already the name of the marker in line 3\n");
}

static void a_place_that_is_taken_is_refused(void **state)
{
	(void)state;
	expect_messages(FOUR "- {name: e, neutral_m: [0.0104, 0, 0.1]}\n",
			"6:25: markers[4].neutral_m: less than 0.5 mm from marker 'b' in line 3\n");
	assert_int_equal(load(FOUR "- {name: e, neutral_m: [0.0106, 0, 0.1]}\n", NULL), 0);
}

static void places_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_messages(
		FOUR "- {name: e, neutral_m: [30, -12.5, 101]}\n",
		"6:25: markers[4].neutral_m: 106.1 m away from the head; coordinates are in "
		"metres, are these millimetres?\n");
	expect_messages(FOUR "- {name: e, neutral_m: [0.03, 0.2]}\n",
			"6:25: markers[4].neutral_m: expected 3 numbers in metres, found "
			"2\n");
	expect_messages(FOUR "- {name: e, neutral_m: [0.03, 0.2, 0, 1]}\n",
			"6:25: markers[4].neutral_m: expected 3 numbers in metres, found "
			"4\n");
	expect_messages(
		FOUR "- {name: e, neutral_m: [0.03, .nan, 3mm]}\n",
		"6:31: markers[4].neutral_m[1]: '.nan' is not a number from -1000000 to "
		"1000000 (metres)\n"
		"6:37: markers[4].neutral_m[2]: '3mm' is not a number, expected a number from "
		"-1000000 to 1000000 (metres) without a unit behind it\n");
	expect_messages(FOUR "- {name: e, neutral_m: 0.5}\n",
			"6:24: markers[4].neutral_m: expected a list\n");
}

static void missing_and_unknown_keys_are_refused(void **state)
{
	(void)state;
	expect_messages(FOUR "- {neutral_m: [0.5, 0, 0], colour: red}\n",
			"6:28: markers[4].colour: unknown key; known here: name, neutral_m, group, "
			"rigid, diameter_m, segment, mpeg4, learned\n"
			"6:4: markers[4].name: missing\n");
	expect_messages(FOUR "- {name: e, rigid: yes}\n",
			"6:20: markers[4].rigid: 'yes' is neither true nor false\n"
			"6:4: markers[4].neutral_m: missing\n");
	expect_messages(
		FOUR "- {name: e e, neutral_m: [0.5, 0, 0], diameter_m: 1.5}\n",
		"6:10: markers[4].name: 'e e' may have only the letters A-Z and a-z, digits, _ "
		"and -\n"
		"6:51: markers[4].diameter_m: 1.5 is out of range, expected a number from "
		"0.0002 to 0.1 (metres)\n");
	expect_messages("actor: a\n", "1:1: markers: missing\n");
}

static void too_few_and_too_many_markers_are_refused(void **state)
{
	static char text[65536] = "markers:\n";

	(void)state;
	expect_messages("markers:\n- {name: a, neutral_m: [0, 0, 0.1]}\n",
			"2:4: markers: 1 markers, but a head needs at least 4\n");
	expect_messages("markers: []\n", "1:1: markers: 0 markers, but a head needs at least 4\n");
	for (int i = 0; i < LABEL_MAX + 2; i++)
		sprintf(text + strlen(text), "- {name: m%d, neutral_m: [0.%02d, 0.%02d, 0]}\n", i,
			i % 100, i / 100);
	expect_messages(text, "770:4: markers[768]: more than 768 markers\n");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_name_and_a_place_are_enough),
		cmocka_unit_test(body_markers_name_their_segment),
		cmocka_unit_test(a_body_without_a_head_is_refused),
		cmocka_unit_test(what_was_learned_of_an_actor_is_read),
		cmocka_unit_test(what_cannot_have_been_learned_is_refused_by_line),
		cmocka_unit_test(actors_stand_behind_one_another),
		cmocka_unit_test(a_doubled_name_names_both_lines),
		cmocka_unit_test(a_place_that_is_taken_is_refused),
		cmocka_unit_test(places_that_cannot_be_are_refused),
		cmocka_unit_test(missing_and_unknown_keys_are_refused),
		cmocka_unit_test(too_few_and_too_many_markers_are_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
