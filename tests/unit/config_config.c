/*
 * The configuration file: ten lines work, and every error is one message that says where it is,
 * what is wrong and what would be right.
 */
#include "config/config.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "one_config.h"

static void five_lines_are_a_configuration(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load(HEAD CAMERAS, &diag), 0);
	assert_null(diag.text);
	assert_string_equal(config.base_dir, "/tmp");
	assert_string_equal(config.rig_dir, "/tmp/rig");
	assert_string_equal(config.layout_paths[0], "/tmp/face.yaml");
	assert_string_equal(config.socket_dir, "/run/stage");
	assert_string_equal(config.recordings_dir, "");
	assert_string_equal(config.trigger, "free");
	assert_int_equal(config.plan.period_ns, 8333333);
	assert_int_equal(config.plan.ir_exposure_ns, 250000);
	assert_int_equal(config.camera_count, 2);
	assert_string_equal(config.cameras[1].name, "ir2");
	assert_string_equal(config.cameras[1].address, "files:take/ir2");
	assert_int_equal(config.cameras[1].role, ROLE_IR);
	assert_int_equal(config.cameras[1].line, 5);
	assert_int_equal(config.cameras[1].wanted.period_ns, 8333333);
	assert_string_equal(config.sim_scene, "talking");
	assert_true(config.blobs.threshold_sigma == blob_settings_default().threshold_sigma);
}

static void every_key_is_read(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(
		load("rig: /srv/rig\nlayout: /srv/face.yaml\ntrigger: sim\nrate_hz: 60\n"
		     "exposure_us: 300.5\nsocket_dir: run\nrecordings_dir: takes\n"
		     "blobs: {threshold_sigma: 5.5, threshold_min: 9, electrons_per_grey: 30, "
		     "area_min_px: 4, area_max_px: 900}\n"
		     "tracking: {match_gate_px: 2, calibration_sigma_px: 0.02, range_min_m: 0.5, "
		     "range_max_m: 6}\n"
		     "sim: {scene: turning, seed: 18446744073709551615, "
		     "epoch_ns: 9007199254740993}\n"
		     "cameras:\n- name: hd1\n  address: sim:hd1\n  role: hd\n  width: 1920\n"
		     "  height: 1080\n  exposure_us: 4000\n  gain_db: 6.5\n",
		     &diag),
		0);
	assert_null(diag.text);
	assert_string_equal(config.rig_dir, "/srv/rig");
	assert_string_equal(config.trigger, "sim");
	assert_string_equal(config.socket_dir, "/tmp/run");
	assert_string_equal(config.recordings_dir, "/tmp/takes");
	assert_int_equal(config.plan.period_ns, 16666667);
	assert_int_equal(config.plan.ir_exposure_ns, 300500);
	assert_int_equal(config.plan.strobe_width_ns, 300500);
	assert_true(config.blobs.threshold_sigma == 5.5 && config.blobs.threshold_min == 9);
	assert_true(config.blobs.electrons_per_grey == 30);
	assert_int_equal(config.blobs.area_min_px, 4);
	assert_int_equal(config.blobs.area_max_px, 900);
	assert_true(config.tracking.match_gate_px == 2 && config.tracking.range_max_m == 6);
	assert_true(config.tracking.calibration_sigma_px == 0.02);
	assert_true(config.tracking.range_min_m == 0.5);
	assert_string_equal(config.sim_scene, "turning");
	assert_true(config.sim_seed == UINT64_MAX);
	assert_true(config.sim_epoch_ns == INT64_C(9007199254740993)); /* no double in between */
	assert_int_equal(config.cameras[0].role, ROLE_HD);
	assert_int_equal(config.cameras[0].wanted.width_px, 1920);
	assert_int_equal(config.cameras[0].wanted.height_px, 1080);
	assert_int_equal(config.cameras[0].wanted.exposure_ns, 4000000);
	assert_int_equal(config.cameras[0].wanted.format, PIXEL_BAYER_RG8);
	assert_int_equal(config.cameras[0].wanted.period_ns, 4 * 16666667);
	assert_true(config.cameras[0].wanted.gain_db == 6.5);
}

static void a_tracked_camera_has_a_global_shutter_and_another_one_what_is_written(void **state)
{
	(void)state;
	assert_int_equal(load(HEAD "cameras:\n- {name: a, address: \"v4l2:a\"}\n"
				   "- {name: b, address: \"v4l2:b\", role: hd}\n"
				   "- {name: c, address: \"v4l2:c\", role: hd, row_time_us: 14.8, "
				   "clock: ptp, receive: packets}\n",
			      NULL),
			 0);
	assert_int_equal(config.cameras[0].wanted.shutter, SHUTTER_GLOBAL);
	assert_int_equal(config.cameras[1].wanted.shutter, SHUTTER_UNKNOWN);
	assert_int_equal(config.cameras[2].wanted.shutter, SHUTTER_ROLLING);
	assert_int_equal(config.cameras[2].wanted.row_time_ns, 14800);
	assert_int_equal(config.cameras[2].wanted.clock, CAMERA_CLOCK_PTP);
	assert_int_equal(config.cameras[2].wanted.receive, CAMERA_RECEIVE_PACKETS);
	expect_messages(
		HEAD
		"cameras:\n- {name: a, address: \"v4l2:x\", shutter: global, row_time_us: 9}\n",
		"4:4: cameras[0]: row_time_us: rows of a global shutter are open together: write "
		"shutter: rolling, or take it out\n");
}

static void a_camera_may_have_a_format_and_controls_of_its_own(void **state)
{
	const struct camera_mode *mode = &config.cameras[0].wanted;

	(void)state;
	assert_int_equal(load(HEAD "cameras:\n- name: a\n  address: \"v4l2:serial=A1\"\n"
				   "  format: grey16\n  bits: 10\n  readout_us: 4200\n"
				   "  controls: {exposure_time_absolute: 50, brightness: -64}\n",
			      NULL),
			 0);
	assert_true(config.cameras[0].has_format);
	assert_int_equal(mode->format, PIXEL_GREY16);
	assert_int_equal(mode->bits, 10);
	assert_int_equal(mode->readout_ns, 4200000);
	assert_int_equal(mode->control_count, 2);
	assert_string_equal(mode->controls[0].name, "exposure_time_absolute");
	assert_int_equal(mode->controls[0].value, 50);
	assert_string_equal(mode->controls[1].name, "brightness");
	assert_int_equal(mode->controls[1].value, -64);
	expect_messages(HEAD "cameras:\n- {name: a, address: \"v4l2:x\", format: mjpeg}\n",
			"4:4: cameras[0]: format: mjpeg is for the role hd; a camera with the role "
			"ir gives grey or grey16\n");
	expect_messages(HEAD "cameras:\n- {name: a, address: \"v4l2:x\", format: jpg}\n",
			"4:40: cameras[0].format: 'jpg' is none of grey, rgb, bayer_rg, bayer_gr, "
			"bayer_gb, bayer_bg, grey16, yuyv, mjpeg\n");
	expect_messages(
		HEAD "cameras:\n- {name: a, address: \"v4l2:x\", controls: {a: 1, b: x, a: 2}}\n",
		"4:52: cameras[0].controls.b: 'x' is not a whole number from -2147483648 to "
		"2147483647\n4:58: cameras[0].controls.a: given twice\n");
	expect_messages(HEAD "cameras:\n- {name: a, address: \"v4l2:x\", controls: 3}\n",
			"4:42: cameras[0].controls: expected 'name: value' lines\n");
}

static void several_actors_have_a_layout_each(void **state)
{
	(void)state;
	assert_int_equal(load("rig: rig\nlayouts: [anna.yaml, /srv/ben.yaml]\n" CAMERAS, NULL), 0);
	assert_int_equal(config.layout_count, 2);
	assert_string_equal(config.layout_paths[0], "/tmp/anna.yaml");
	assert_string_equal(config.layout_paths[1], "/srv/ben.yaml");
	expect_messages("rig: rig\nlayouts: []\n" CAMERAS, "2:1: layouts: no layout in the list\n");
	expect_messages("rig: rig\nlayouts: [a, b, c, d, e, f, g]\n" CAMERAS,
			"2:29: layouts[6]: more than 6 layouts\n");
	expect_messages(HEAD "layouts: [a]\n" CAMERAS,
			"3:11: layouts: layout stands in line 2: write one of the two\n");
}

static void json_is_read_too(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(load("{\"rig\": \"rig\", \"layout\": \"face.json\", \"rate_hz\": 1.2e2,\n"
			      "\t\"cameras\": [{\"name\": \"a\", \"address\": \"sim:a\"}]}",
			      &diag),
			 0);
	assert_null(diag.text);
	assert_int_equal(config.plan.period_ns, 8333333);
}

static void all_errors_come_in_one_run(void **state)
{
	(void)state;
	expect_messages(
		"rig: rig\nrate_hz: 30fps\nexposure: 200\ncameras:\n"
		"- {name: a b, address: 'x', role: uv}\n- {address: sim:1, width: 12.5}\n",
		"2:10: rate_hz: '30fps' is not a number, expected a number from 1 to 1000 (hertz) "
		"without a unit behind it\n"
		"3:1: exposure: unknown key; did you mean 'exposure_us'?\n"
		"5:10: cameras[0].name: 'a b' may have only the letters A-Z and a-z, digits, _ and "
		"-\n"
		"5:35: cameras[0].role: 'uv' is unknown, expected ir or hd\n"
		"5:24: cameras[0].address: 'x' is not driver:device, for example "
		"aravis:192.168.1.7\n"
		"6:27: cameras[1].width: '12.5' is not a whole number from 32 to 16384 (pixels)\n"
		"6:4: cameras[1].name: missing\n"
		"1:1: layout: missing\n");
}

static void a_board_that_cannot_be_is_refused(void **state)
{
	(void)state;
	expect_messages(HEAD CAMERAS "calibration: {board: {squares_x: 11, squares_y: 2, square_m: "
				     "0.06}}\n",
			"6:49: calibration.board.squares_y: 2 is out of range, expected a whole "
			"number from 4 "
			"to 24 (squares)\n");
	expect_messages(HEAD CAMERAS "calibration: {board: {squares_x: 11, squares_y: 8}}\n",
			"6:23: calibration.board.square_m: missing\n");
}

static void unknown_keys_are_refused_with_a_suggestion(void **state)
{
	(void)state;
	expect_messages(
		HEAD CAMERAS "blobs: {treshold_sigma: 5}\n",
		"6:9: blobs.treshold_sigma: unknown key; did you mean 'threshold_sigma'?\n");
	expect_messages(
		HEAD CAMERAS "sim: {wheels: 4}\n",
		"6:7: sim.wheels: unknown key; known here: scene, seed, epoch_ns, clock, faults\n");
	expect_messages(
		HEAD CAMERAS "<<: {rate_hz: 3}\n",
		"6:1: <<: unknown key; known here: rig, layout, layouts, cameras, trigger, "
		"rate_hz, "
		"exposure_us, ir_delay_us, strobe_delay_us, strobe_width_us, strobe_duty_max, hd, "
		"socket_dir, masks, blobs, tracking, sim, calibration, strobe_one_shot_us, "
		"strobe_pull_down, recordings_dir\n");
	expect_messages(HEAD CAMERAS "[a]: 3\n", "6:2: a key must be a plain word\n");
}

static void doubled_things_are_named_with_both_lines(void **state)
{
	(void)state;
	expect_messages(HEAD CAMERAS "rig: other\n", "6:1: rig: given twice, first in line 1\n");
	expect_messages(HEAD CAMERAS "- {name: ir1, address: sim:1}\n",
			"6:10: cameras[2].name: 'ir1' is already the camera of line 4\n");
	expect_messages(HEAD CAMERAS "- {name: ir3, address: 'files:take/ir2'}\n",
			"6:24: cameras[2].address: 'files:take/ir2' is already the address of the "
			"camera of line 5\n");
}

static void only_plain_decimal_numbers_are_numbers(void **state)
{
	static const char *const wrong[] = {"nan",  ".inf",  "0x20", "1_000",
					    "true", "60 Hz", "+-1",  "1e"};

	(void)state;
	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		struct diag diag = {0};
		char text[512];

		snprintf(text, sizeof(text), HEAD CAMERAS "rate_hz: %s\n", wrong[i]);
		assert_int_equal(load(text, &diag), -EINVAL);
		assert_int_equal(diag.count, 1);
		assert_non_null(strstr(diag.text, ":6:10: rate_hz: '"));
		assert_non_null(strstr(diag.text, "a number from 1 to 1000 (hertz)"));
		diag_finish(&diag);
	}
	expect_messages(HEAD CAMERAS "rate_hz: \"60\"\n",
			"6:10: rate_hz: '60' is a text in quotes, expected a number from 1 to 1000 "
			"(hertz)\n");
	expect_messages(HEAD CAMERAS "rate_hz: 5000\n",
			"6:10: rate_hz: 5000 is out of range, expected a number from 1 to 1000 "
			"(hertz)\n");
	expect_messages(HEAD CAMERAS "rate_hz:\n",
			"6:1: rate_hz: has no value; expected a number from 1 to 1000 (hertz)\n");
	expect_messages(HEAD CAMERAS "sim: {seed: -1, epoch_ns: 9223372036854775808}\n",
			"6:13: sim.seed: '-1' is not a whole number from 0 to "
			"18446744073709551615\n"
			"6:27: sim.epoch_ns: 9223372036854775808 is out of range, expected a whole "
			"number from 0 to 9223372036854775807\n");
}

static void values_of_the_wrong_kind_are_refused(void **state)
{
	(void)state;
	expect_messages(HEAD "cameras: ir1\n", "3:10: cameras: expected a list\n");
	expect_messages(HEAD "cameras: []\n", "3:1: cameras: no camera in the list\n");
	expect_messages(HEAD "cameras: [ir1]\n",
			"3:11: cameras[0]: expected 'key: value' lines, beginning with name\n");
	expect_messages("[1, 2]\n", "1:2: expected 'key: value' lines, beginning with rig\n");
	expect_messages("rig: [a]\nlayout: {b: c}\n" CAMERAS,
			"1:7: rig: expected a text\n2:10: layout: expected a text\n");
	expect_messages("rig: \"a\\nb\"\nlayout: ''\n" CAMERAS,
			"1:6: rig: control characters are not allowed\n2:9: layout: is empty\n");
	expect_messages(HEAD CAMERAS "socket_dir: /a234567890/b234567890/c234567890/d234567890/"
				     "e234567890/f234567890/g234567890/h234567890\n",
			"6:13: socket_dir: the path "
			"/a234567890/b234567890/c234567890/d234567890/e234567890/f234... is longer "
			"than 87 bytes\n");
}

static void text_that_is_not_yaml_is_refused_with_its_place(void **state)
{
	struct diag diag = {0};

	(void)state;
	expect_messages("", "1:1: the file is empty\n");
	expect_messages("# nothing\n", "1:1: the file is empty\n");
	expect_messages("rig: [a,\n", "2:1: not YAML: did not find expected node content\n");
	expect_messages(HEAD CAMERAS "---\nrig: b\n",
			"1:1: more than one document (---) in the file\n");
	write_file("rig: a\0b\n", 9);
	assert_int_equal(config_load(&config, path, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, ":1:7: not YAML: byte 0x00 is no text (UTF-8)"));
	diag_finish(&diag);
	expect_messages("rig: a\nrig: \xc3\xbc\xff\n",
			"2:8: not YAML: byte 0xff is no text (UTF-8)\n");
	/* the YAML library would never come back from this */
	expect_messages("%c\xdf: a\n", "1:3: not YAML: byte 0xdf is no text (UTF-8)\n");
}

static void bombs_are_harmless(void **state)
{
	char *large = malloc((1 << 20) + 2);
	struct diag diag = {0};

	(void)state;
	assert_non_null(large);
	memset(large, '[', 1 << 20);
	large[1 << 20] = '\0';
	expect_messages(large, "1:64: not YAML: Max depth (64) exceeded\n");
	strcat(large, "["); /* one byte too many */
	assert_int_equal(load(large, &diag), -EFBIG);
	assert_non_null(strstr(diag.text, ": larger than the 1048576 bytes"));
	diag_finish(&diag);
	free(large);
	expect_messages("rig: &a x\nlayout: *a\n" CAMERAS,
			"2:9: layout: aliases (*) are not read here; write the value out\n");
	expect_messages(HEAD "cameras: &c [*c, *c]\n",
			"3:14: cameras[0]: expected 'key: value' lines, beginning with name\n"
			"3:18: cameras[1]: expected 'key: value' lines, beginning with name\n");
}

static void more_cameras_than_the_mask_has_bits_are_refused(void **state)
{
	char text[8192] = HEAD "cameras:\n";

	(void)state;
	for (int i = 0; i < 40; i++)
		sprintf(text + strlen(text), "- {name: c%d, address: sim:%d}\n", i, i);
	expect_messages(text, "36:4: cameras[32]: more than 32 cameras\n");
}

static void failure_leaves_the_caller_s_config_alone(void **state)
{
	(void)state;
	memset(&config, 0x5a, sizeof(config));
	assert_int_equal(load("rig: 1\n", NULL), -EINVAL);
	assert_int_equal(config.camera_count, 0x5a5a5a5a);
	assert_int_equal(config_load(&config, "/nonexistent/stage.yaml", NULL), -ENOENT);
	assert_int_equal(config_load(&config, "/tmp", NULL), -EISDIR);
	assert_int_equal(config_load(&config, "/dev/zero", NULL), -ENOTSUP);
	assert_int_equal(config.camera_count, 0x5a5a5a5a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(five_lines_are_a_configuration),
		cmocka_unit_test(every_key_is_read),
		cmocka_unit_test(a_camera_may_have_a_format_and_controls_of_its_own),
		cmocka_unit_test(
			a_tracked_camera_has_a_global_shutter_and_another_one_what_is_written),
		cmocka_unit_test(several_actors_have_a_layout_each),
		cmocka_unit_test(json_is_read_too),
		cmocka_unit_test(all_errors_come_in_one_run),
		cmocka_unit_test(a_board_that_cannot_be_is_refused),
		cmocka_unit_test(unknown_keys_are_refused_with_a_suggestion),
		cmocka_unit_test(doubled_things_are_named_with_both_lines),
		cmocka_unit_test(only_plain_decimal_numbers_are_numbers),
		cmocka_unit_test(values_of_the_wrong_kind_are_refused),
		cmocka_unit_test(text_that_is_not_yaml_is_refused_with_its_place),
		cmocka_unit_test(bombs_are_harmless),
		cmocka_unit_test(more_cameras_than_the_mask_has_bits_are_refused),
		cmocka_unit_test(failure_leaves_the_caller_s_config_alone),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_file, remove_file);
}
