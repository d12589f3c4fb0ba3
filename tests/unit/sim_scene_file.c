/*
 * Scene files: what they say is what is played, and every mistake has its place and its words, all
 * of them in one run.
 */
#include "sim/world/scene_file.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "one_file.h"
#include "sim/world/scene_find.h"

#define HEAD "title: a test\nseconds: 10\n"
#define ANNA "actors:\n- {name: anna}\n"
#define TWO "actors:\n- {name: anna}\n- {name: bert, seat_m: [0.6, -0.6, 1.2]}\n"

static struct sim_script script;

static int load(const char *text, struct sim_options options, struct diag *diag)
{
	write_file(text, strlen(text));
	options.scene = path;
	return sim_script_load(&script, &options, diag);
}

static void expect_messages(const char *text, const char *messages)
{
	struct diag diag = {0};

	assert_int_equal(load(text, (struct sim_options){0}, &diag), -EINVAL);
	expect_lines(&diag, messages);
}

static void expect_good(const char *text)
{
	struct diag diag = {0};
	int err = load(text, (struct sim_options){0}, &diag);

	if (err)
		diag_print(&diag, stderr);
	assert_int_equal(err, 0);
	assert_int_equal(diag.count, 0);
}

static void a_title_a_length_and_an_actor_are_enough(void **state)
{
	(void)state;
	expect_good(HEAD ANNA);
	assert_string_equal(script.title, "a test");
	assert_true(script.seconds == 10 && script.rate_hz == 120);
	assert_int_equal(script.camera_count, 4);
	assert_int_equal(script.actor_count, 1);
	assert_int_equal(script.actors[0].face_markers, 70);
	assert_int_equal(script.actors[0].performance, SIM_TALKING);
}

static void all_values_are_read(void **state)
{
	(void)state;
	expect_good(
		"title: t\ncomment: c\nseconds: 20\nrate_hz: 60\ncameras: 6\nhd_cameras: 2\n"
		"placement: room\nlens: splined\noptics: tailed\nring_lights: true\n"
		"cross_strobes: true\nambient_grey: 3\nactors:\n"
		"- {name: a, face_markers: 182, body_markers: 22, face_diameter_m: 0.003,\n"
		"   hemispheres: true, seat_m: [1, 2, 1.5], facing_deg: 90,\n"
		"   performance: shaking, face_speed_m_s: 0.7, shake_speed_m_s: 1,\n"
		"   neutral_start_s: 1, neutral_end_s: 2, reapplied_m: 0.001,\n"
		"   ghosts_teeth: true, ghosts_eyes: true}\n"
		"events:\n- {kind: micro, actor: a, what: lid, at_s: 3, for_s: 1, amount: 0.2}\n"
		"faults:\n- {camera: ir5, kind: bump, at_s: 4, angle_mrad: 0.3}\n");
	const struct sim_actor_script *a = &script.actors[0];

	assert_string_equal(script.comment, "c");
	assert_int_equal(script.camera_count, 6);
	assert_int_equal(script.hd_camera_count, 2);
	assert_int_equal(script.placement, SIM_PLACEMENT_ROOM);
	assert_int_equal(script.lens, SIM_LENS_SPLINED);
	assert_int_equal(script.optics, SIM_OPTICS_TAILED);
	assert_true(script.ring_lights && script.cross_strobes && script.ambient_grey == 3);
	assert_int_equal(a->face_markers, 182);
	assert_int_equal(a->body_markers, 22);
	assert_int_equal(a->performance, SIM_SHAKING);
	assert_true(a->seat_m.x == 1 && a->seat_m.y == 2 && a->seat_m.z == 1.5);
	assert_true(a->hemispheres && a->ghosts_teeth && a->ghosts_eyes);
	assert_true(a->facing_deg == 90 && a->face_speed_m_s == 0.7 && a->shake_speed_m_s == 1);
	assert_true(a->neutral_start_s == 1 && a->neutral_end_s == 2 && a->reapplied_m == 0.001);
	assert_int_equal(script.events[0].kind, SIM_EVENT_MICRO);
	assert_true(script.events[0].at_s == 3 && script.events[0].amount == 0.2);
	assert_string_equal(script.faults.faults[0].device, "ir5");
	assert_true(script.faults.faults[0].angle_mrad == 0.3);
}

static void options_stand_in_the_place_of_a_scenes_own_values(void **state)
{
	struct sim_faults more = {1, {{.camera = "c", .kind = SIM_FAULT_DROP, .device = "ir0"}}};
	struct sim_options options = {.camera_count = 8,
				      .hd_camera_count = 1,
				      .rate_hz = 30,
				      .optics = "tailed",
				      .faults = &more};

	(void)state;
	assert_int_equal(load(HEAD ANNA "faults: [{camera: ir3, kind: dark}]\n", options, NULL), 0);
	assert_int_equal(script.camera_count, 8);
	assert_int_equal(script.hd_camera_count, 1);
	assert_true(script.rate_hz == 30);
	assert_int_equal(script.optics, SIM_OPTICS_TAILED);
	assert_int_equal(script.faults.count, 2);
	assert_string_equal(script.faults.faults[1].device, "ir0");
}

static void every_scene_of_the_list_can_be_read(void **state)
{
	static char names[SCENE_NAMES_MAX][NAME_BYTES];
	size_t count = 0;
	struct diag diag = {0};

	(void)state;
	assert_int_equal(scene_names(names, &count, &diag), 0);
	assert_true(count >= 14);
	for (size_t i = 0; i < count; i++) {
		struct sim_options options = {.scene = names[i]};

		if (sim_script_load(&script, &options, &diag))
			diag_print(&diag, stderr);
		assert_string_equal(script.name, names[i]);
		assert_true(*script.title);
	}
	assert_int_equal(diag.count, 0);
}

static void a_scene_that_is_not_there_is_named_beside_those_that_are(void **state)
{
	struct sim_options options = {.scene = "singing"};
	struct diag diag = {0};

	(void)state;
	assert_int_equal(sim_script_load(&script, &options, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "no scene 'singing'"));
	assert_non_null(strstr(diag.text, "07-seventeen-minutes"));
	diag_finish(&diag);
	options.scene = "/nowhere/singing.yaml";
	assert_int_equal(sim_script_load(&script, &options, &diag), -ENOENT);
	assert_non_null(strstr(diag.text, "/nowhere/singing.yaml"));
	diag_finish(&diag);
}

static void a_scene_without_anybody_is_refused(void **state)
{
	(void)state;
	expect_messages(HEAD, "1:1: actors: missing: a scene has actors or board: true\n");
	expect_messages(HEAD "actors: []\n",
			"3:1: actors: nobody is in the list: a scene has actors or board: true\n");
	expect_messages(HEAD "board: true\n" ANNA,
			"3:8: board: a board is waved instead of actors, not beside them\n");
	expect_good(HEAD "board: true\n");
}

static void actors_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_messages(HEAD "actors:\n- {name: a, face_markers: 36}\n",
			"4:27: actors[0].face_markers: there is no face of 36 markers: use 0, 35, "
			"70 or 182\n");
	expect_messages(HEAD "actors:\n- {name: a, body_markers: 4}\n",
			"4:27: actors[0].body_markers: there is no body of 4 markers: use 0 or "
			"22\n");
	expect_messages(HEAD "actors:\n- {name: a, face_markers: 0}\n",
			"4:27: actors[0].face_markers: the actor wears no markers at all\n");
	expect_messages(HEAD "actors:\n- {name: a, neutral_start_s: 6, neutral_end_s: 5}\n",
			"4:48: actors[0].neutral_end_s: the neutrals take 11 s of a scene of 10 "
			"s\n");
	expect_messages(HEAD "actors:\n- {name: a, seat_m: [0, 1]}\n",
			"4:22: actors[0].seat_m: expected 3 numbers in metres, found 2\n");
	expect_messages(HEAD "actors:\n- {name: a, performance: singing}\n",
			"4:26: actors[0].performance: 'singing' is unknown, expected still or "
			"talking or turning or shaking or range_of_motion\n");
}

static void two_actors_are_two(void **state)
{
	(void)state;
	expect_messages(HEAD "actors:\n- {name: a}\n- {name: a, seat_m: [0, -0.3, 1.2]}\n",
			"5:10: actors[1].name: 'a' is already the actor of line 4\n"
			"5:22: actors[1].seat_m: 0.30 m from the actor of line 4: heads need 0.4 "
			"m\n");
	expect_good(HEAD TWO);
}

static void a_face_that_meets_a_camera_is_refused(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load(HEAD "cameras: 8\nactors:\n- {name: a}\n"
				   "- {name: b, seat_m: [0.1, 1.25, 1.15]}\n",
			      (struct sim_options){0}, &diag),
			 -EINVAL);
	assert_non_null(strstr(diag.text, ":6:22: actors[1].seat_m: the face meets camera ir"));
	diag_finish(&diag);
}

#define EVENT(text) HEAD ANNA "events:\n- {" text "}\n"

static void events_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_messages(EVENT("kind: melt, at_s: 1"),
			"6:10: events[0].kind: 'melt' is unknown, expected expression or fall_off "
			"or hand or passer or jig_slip or turn or micro\n");
	expect_messages(EVENT("kind: expression, what: gloom, at_s: 1, for_s: 1, amount: 1"),
			"6:28: events[0].what: actor 'anna' has no expression 'gloom'\n");
	expect_messages(EVENT("kind: fall_off, what: cheek_l_99, at_s: 1"),
			"6:26: events[0].what: actor 'anna' has no marker 'cheek_l_99'\n");
	expect_messages(EVENT("kind: micro, what: tail, at_s: 1, for_s: 1, amount: 1"),
			"6:23: events[0].what: actor 'anna' has no marker group 'tail'\n");
	expect_messages(EVENT("kind: fall_off, at_s: 1"),
			"6:4: events[0].what: missing: which marker?\n");
	expect_messages(EVENT("kind: hand, what: left, at_s: 1, for_s: 1"),
			"6:22: events[0].what: this kind of event has none\n");
}

static void events_at_impossible_times_are_refused(void **state)
{
	(void)state;
	expect_messages(EVENT("kind: hand, at_s: -1, for_s: 1"),
			"6:22: events[0].at_s: -1 is out of range, expected a number from 0 to "
			"1000000 (seconds)\n");
	expect_messages(EVENT("kind: hand, at_s: 10, for_s: 1"),
			"6:22: events[0].at_s: 10 s is after the scene's end at 10 s\n");
	expect_messages(EVENT("kind: hand, at_s: 1"),
			"6:4: events[0].for_s: missing: how many seconds does it take?\n");
	expect_messages(EVENT("kind: hand, for_s: 1"), "6:4: events[0].at_s: missing\n");
}

static void events_of_impossible_amounts_are_refused(void **state)
{
	(void)state;
	expect_messages(
		EVENT("kind: expression, what: blink, at_s: 1, for_s: 1, amount: 1.5"),
		"6:62: events[0].amount: 1.5 is out of range, expected 0 to 1 (of the whole "
		"expression)\n");
	expect_messages(EVENT("kind: turn, at_s: 1, for_s: 1"),
			"6:4: events[0].amount: missing: from -90 to 90 (degrees)\n");
	expect_messages(EVENT("kind: hand, at_s: 1, for_s: 1, amount: 2"),
			"6:43: events[0].amount: this kind of event has none\n");
}

static void an_event_must_say_whose_it_is_among_several(void **state)
{
	(void)state;
	expect_messages(HEAD TWO "events:\n- {kind: hand, at_s: 1, for_s: 1}\n",
			"7:4: events[0].actor: which of the 2 actors?\n");
	expect_messages(HEAD TWO "events:\n- {kind: hand, actor: carl, at_s: 1, for_s: 1}\n",
			"7:23: events[0].actor: there is no actor 'carl'\n");
	expect_good(HEAD TWO "events:\n- {kind: passer, at_s: 1, for_s: 1}\n"
			     "- {kind: hand, actor: bert, at_s: 1, for_s: 1}\n");
}

#define FAULT(text) HEAD ANNA "faults:\n- {" text "}\n"

static void faults_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_messages(FAULT("camera: ir4, kind: drop"),
			"6:4: faults[0].camera: there is no camera 'ir4': the scene has ir0 to ir3 "
			"and 0 HD cameras\n");
	expect_messages(FAULT("camera: ir1, kind: drop, at_s: 11"),
			"6:4: faults[0].at_s: 11 s is after the scene's end at 10 s\n");
	expect_messages(FAULT("camera: ir1, kind: drop, at_s: -2"),
			"6:35: faults[0].at_s: -2 is out of range, expected a number from 0 to "
			"1000000 (seconds)\n");
	expect_messages(
		FAULT("camera: ir1, kind: phase_slip"),
		"6:4: faults[0].camera: camera 'ir1' has no phase to slip from: it is no HD "
		"camera\n");
	expect_messages(
		FAULT("camera: ir1, kind: slow_disk"),
		"6:4: faults[0].camera: camera 'ir1' reads no disk: slow_disk is for files: "
		"cameras\n");
	expect_messages(
		FAULT("camera: ir1, kind: melt"),
		"6:23: faults[0].kind: 'melt' is unknown, expected drop or miss or delay or "
		"repeat or shift or stamp_shift or freeze or unplug or dark or phase_slip or "
		"stuck_exposure or bump or clock_step or slow_disk or strobe_leak\n");
}

static void all_mistakes_are_told_at_once(void **state)
{
	(void)state;
	expect_messages("titel: t\nseconds: 0\nactors:\n- {name: a, face_markers: 71}\n"
			"events:\n- {kind: hand, at_s: -1, for_s: 1}\n"
			"faults:\n- {camera: ir9, kind: drop}\n",
			"1:1: titel: unknown key; did you mean 'title'?\n"
			"2:10: seconds: 0 is out of range, expected a number from 0.1 to 86400 "
			"(seconds)\n"
			"6:22: events[0].at_s: -1 is out of range, expected a number from 0 to "
			"1000000 (seconds)\n"
			"1:1: title: missing\n"
			"4:27: actors[0].face_markers: there is no face of 71 markers: use 0, 35, "
			"70 or 182\n"
			"8:4: faults[0].camera: there is no camera 'ir9': the scene has ir0 to ir3 "
			"and 0 HD cameras\n");
}

static void lists_have_an_end(void **state)
{
	char text[16384] = HEAD ANNA "events:\n";

	(void)state;
	for (int i = 0; i <= SIM_EVENT_MAX; i++)
		strcat(text, "- {kind: hand, at_s: 1, for_s: 1}\n");
	expect_messages(text, "70:4: events[64]: more than 64 events\n");
	strcpy(text, HEAD "placement: room\nactors:\n");
	for (int i = 0; i <= SIM_ACTOR_MAX; i++)
		sprintf(text + strlen(text), "- {name: a%d, seat_m: [%g, 0, 1.2]}\n", i,
			0.5 * i - 1.5);
	expect_messages(text, "11:4: actors[6]: more than 6 actors\n");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_title_a_length_and_an_actor_are_enough),
		cmocka_unit_test(all_values_are_read),
		cmocka_unit_test(options_stand_in_the_place_of_a_scenes_own_values),
		cmocka_unit_test(every_scene_of_the_list_can_be_read),
		cmocka_unit_test(a_scene_that_is_not_there_is_named_beside_those_that_are),
		cmocka_unit_test(a_scene_without_anybody_is_refused),
		cmocka_unit_test(actors_that_cannot_be_are_refused),
		cmocka_unit_test(two_actors_are_two),
		cmocka_unit_test(a_face_that_meets_a_camera_is_refused),
		cmocka_unit_test(events_that_cannot_be_are_refused),
		cmocka_unit_test(events_at_impossible_times_are_refused),
		cmocka_unit_test(events_of_impossible_amounts_are_refused),
		cmocka_unit_test(an_event_must_say_whose_it_is_among_several),
		cmocka_unit_test(faults_that_cannot_be_are_refused),
		cmocka_unit_test(all_mistakes_are_told_at_once),
		cmocka_unit_test(lists_have_an_end),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
