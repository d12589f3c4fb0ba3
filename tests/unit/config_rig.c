/*
 * A rig loads from mrcal's files, and every way to spoil a model file gives a message that names
 * file and field.
 */
#include "config/rig.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#define GOOD_LENS "'lensmodel': 'LENSMODEL_OPENCV4',\n"
#define GOOD_INTRINSICS "'intrinsics': [ 900, 901.5, 319.5, 239.5, -0.1, 0.02, 1e-3, -1e-3 ],\n"
#define GOOD_EXTRINSICS "'extrinsics': [ 0.1, -0.2, 0.3, 0.5, -0.25, 2.0 ],\n"
#define GOOD_SIZE "'imagersize': [ 640, 480 ],\n"

static char dir[] = "/tmp/config_rigXXXXXX";

static void write_model(const char *name, const char *text)
{
	char path[128];

	snprintf(path, sizeof(path), "%s/%s.cameramodel", dir, name);
	FILE *file = fopen(path, "w");
	assert_non_null(file);
	fputs(text, file);
	fclose(file);
}

static int load(struct rig *rig, struct diag *diag, uint32_t count)
{
	const char names[2][NAME_BYTES] = {"ir1", "ir2"};

	return rig_load(rig, dir, names, count, diag);
}

/* Loads `text` as ir1 and expects the message DIR/ir1.cameramodel: `message`. */
static void expect_refused(const char *text, const char *message)
{
	struct rig rig = {0};
	struct diag diag = {0};
	char expected[512];

	write_model("ir1", text);
	assert_int_equal(load(&rig, &diag, 1), -EINVAL);
	assert_int_equal(rig.camera_count, 0);
	snprintf(expected, sizeof(expected),
		 "%s/ir1.cameramodel: %s; recalibrate or restore the file\n", dir, message);
	assert_string_equal(diag.text, expected);
	diag_finish(&diag);
}

static void good_models_give_views_in_the_order_of_the_names(void **state)
{
	struct rig rig = {0};
	struct diag diag = {0};
	double q[2];

	(void)state;
	write_model("ir1",
		    "# calibrated on site\n{\n" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE
		    "'valid_intrinsics_region': [[1,2],[3,4]], 'x': b'a]}', }\n");
	write_model("ir2",
		    "{'lensmodel': \"LENSMODEL_PINHOLE\", 'intrinsics': [900, 900, 319.5, 239.5],"
		    "'extrinsics': [0, 0, 0, 0, 0, 2], 'imagersize': [640, 480]}");
	assert_int_equal(load(&rig, &diag, 2), 0);
	assert_null(diag.text);
	assert_string_equal(rig.names[1], "ir2");
	assert_int_equal(strlen(rig.revision), 16);
	/* extrinsics take stage coordinates to camera coordinates: the stage origin lies 2 m ahead
	 */
	assert_true(view_project(&rig.views[1], (struct vec3){0, 0, 0}, q, NULL));
	assert_true(hypot(q[0] - 319.5, q[1] - 239.5) < 1e-4);
	assert_true(vec3_distance(rig.views[1].centre_stage_m, (struct vec3){0, 0, -2}) < 1e-12);
	rig_finish(&rig);
}

static void expect_revision(const char *first, bool same)
{
	struct rig rig = {0};

	assert_int_equal(load(&rig, NULL, 2), 0);
	assert_int_equal(strcmp(rig.revision, first) == 0, same);
	rig_finish(&rig);
}

static void the_revision_is_of_what_projects_and_not_of_the_text_around_it(void **state)
{
	struct rig rig = {0};
	char first[17];

	(void)state;
	write_model("ir1", "{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}");
	write_model("ir2", "{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}");
	assert_int_equal(load(&rig, NULL, 2), 0);
	memcpy(first, rig.revision, sizeof(first));
	rig_finish(&rig);
	expect_revision(first, true);
	write_model("ir2", "# touched\n{" GOOD_SIZE GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS
			   "'icam_intrinsics': 1, 'optimization_inputs': b'P)h>@', }");
	expect_revision(first, true);
	write_model("ir2", "{" GOOD_LENS GOOD_INTRINSICS
			   "'extrinsics': [0, 0, 0, 0, 0, 2.0000000000000004]," GOOD_SIZE "}");
	expect_revision(first, false);
	write_model("ir2",
		    "{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS "'imagersize': [640, 481]}");
	expect_revision(first, false);
}

static void a_spoilt_field_is_named(void **state)
{
	(void)state;
	expect_refused("{" GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}", "lensmodel: missing");
	expect_refused("{" GOOD_LENS GOOD_EXTRINSICS GOOD_SIZE "}", "intrinsics: missing");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS GOOD_SIZE "}", "extrinsics: missing");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS "}", "imagersize: missing");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS "'extrinsics': [1,2,3,4,5],\n" GOOD_SIZE "}",
		       "extrinsics: expected 6 numbers, found 5");
	expect_refused("{" GOOD_LENS "'intrinsics': [900, 900, 1]," GOOD_EXTRINSICS GOOD_SIZE "}",
		       "intrinsics: expected 8 numbers for LENSMODEL_OPENCV4, found 3");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS "'imagersize': [640]}",
		       "imagersize: expected 2 numbers, found 1");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS "'imagersize': 640}",
		       "imagersize: expected a list of numbers");
	expect_refused("{" GOOD_LENS GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}",
		       "lensmodel: given twice");
}

static void numbers_that_cannot_be_are_refused(void **state)
{
	(void)state;
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS "'extrinsics': [1,2,nan,4,5,6]," GOOD_SIZE "}",
		       "extrinsics: number 3 is 'nan', which is not a finite number");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS "'extrinsics': [1,2,'3',4,5,6]," GOOD_SIZE "}",
		       "extrinsics: number 3 is ''3'', which is not a finite number");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS "'extrinsics': [1,2,1e999,4,5,6]," GOOD_SIZE
		       "}",
		       "extrinsics: number 3 is '1e999', which is not a finite number");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS "'extrinsics': [0,0,0,500,2000,1]," GOOD_SIZE
		       "}",
		       "extrinsics: farther than 1000 m from the stage; are these millimetres?");
	expect_refused("{" GOOD_LENS GOOD_INTRINSICS GOOD_EXTRINSICS
		       "'imagersize': [640, 4800000]}",
		       "imagersize: expected [width, height] of 32 to 16384 pixels");
	expect_refused("{" GOOD_LENS
		       "'intrinsics': [-900, 901, 319, 239, 0, 0, 0, 0]," GOOD_EXTRINSICS GOOD_SIZE
		       "}",
		       "intrinsics: the focal lengths (first two numbers) must be above 0");
	expect_refused("{" GOOD_LENS
		       "'intrinsics': [900, 901, 319, 239, -9, 0, 0, 0]," GOOD_EXTRINSICS GOOD_SIZE
		       "}",
		       "intrinsics: the lens model cannot be inverted at pixel (0, 0)");
}

static void lens_models_that_cannot_serve_are_refused(void **state)
{
	(void)state;
	expect_refused(
		"{'lensmodel': 'LENSMODEL_FISH'," GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}",
		"lensmodel: unknown model 'LENSMODEL_FISH', expected LENSMODEL_PINHOLE, "
		"STEREOGRAPHIC, LONLAT, LATLON, OPENCV4, OPENCV5, OPENCV8, OPENCV12, CAHVOR or "
		"SPLINED_STEREOGRAPHIC");
	expect_refused(
		"{'lensmodel': 'LENSMODEL_CAHVORE_linearity=0.5'," GOOD_INTRINSICS GOOD_EXTRINSICS
			GOOD_SIZE "}",
		"lensmodel: CAHVORE cannot be inverted; convert it with mrcal-convert-lensmodel");
	expect_refused("{'lensmodel': "
		       "'LENSMODEL_SPLINED_STEREOGRAPHIC_order=9_Nx=65535_Ny=65535_fov_x_deg=60'"
		       "," GOOD_INTRINSICS GOOD_EXTRINSICS GOOD_SIZE "}",
		       "lensmodel: bad configuration of the model "
		       "'LENSMODEL_SPLINED_STEREOGRAPHIC_order=9_Nx=65535_Ny=65535_fov_x_deg=60'");
}

static void text_that_is_no_model_is_refused(void **state)
{
	const char *const texts[] = {"",          "{",
				     "hello",     "{'lensmodel'",

				     "[1,2]",     "{'a': [[[1,2]}",
				     "\xff\xfe{}"};

	(void)state;
	for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++)
		expect_refused(texts[i],
			       "not a complete camera model: a dictionary {'lensmodel': ...} "
			       "is expected");
}

static void every_bad_camera_has_its_message_in_one_run(void **state)
{
	struct rig rig = {0};
	struct diag diag = {0};
	char expected[512];

	(void)state;
	write_model("ir1", "{" GOOD_LENS GOOD_INTRINSICS GOOD_SIZE "}");
	snprintf(expected, sizeof(expected), "%s/ir2.cameramodel", dir);
	unlink(expected);
	assert_int_equal(load(&rig, &diag, 2), -EINVAL);
	snprintf(expected, sizeof(expected),
		 "%s/ir1.cameramodel: extrinsics: missing; recalibrate or restore the file\n"
		 "%s/ir2.cameramodel: No such file or directory; a rig has a model named like each "
		 "of its cameras\n",
		 dir, dir);
	assert_string_equal(diag.text, expected);
	diag_finish(&diag);
}

static void a_rig_that_is_not_there_is_one_message(void **state)
{
	const char names[2][NAME_BYTES] = {"ir1", "ir2"};
	struct rig rig = {0};
	struct diag diag = {0};

	(void)state;
	assert_int_equal(rig_load(&rig, "/nonexistent/rig", names, 2, &diag), -EINVAL);
	assert_string_equal(diag.text, "/nonexistent/rig: not a directory; a rig is a directory of "
				       "NAME.cameramodel files\n");
	diag_finish(&diag);
}

static void images_of_another_size_are_refused(void **state)
{
	struct rig rig = {.camera_count = 1, .names = {"ir1"}};
	struct diag diag = {0};

	(void)state;
	rig.views[0].width_px = 640;
	rig.views[0].height_px = 480;
	assert_int_equal(rig_check_size(&rig, 0, 640, 480, &diag), 0);
	assert_int_equal(rig_check_size(&rig, 0, 1280, 480, &diag), -EINVAL);
	assert_string_equal(
		diag.text, "camera ir1: images are 1280x480 but the rig's ir1.cameramodel was made "
			   "for 640x480 (imagersize); set the camera's width and height or use the "
			   "rig of this camera\n");
	diag_finish(&diag);
}

static int make_dir(void **state)
{
	(void)state;
	return mkdtemp(dir) ? 0 : -1;
}

static int remove_dir(void **state)
{
	char path[128];

	(void)state;
	for (int i = 1; i <= 2; i++) {
		snprintf(path, sizeof(path), "%s/ir%d.cameramodel", dir, i);
		unlink(path);
	}
	return rmdir(dir);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(good_models_give_views_in_the_order_of_the_names),
		cmocka_unit_test(the_revision_is_of_what_projects_and_not_of_the_text_around_it),
		cmocka_unit_test(a_spoilt_field_is_named),
		cmocka_unit_test(numbers_that_cannot_be_are_refused),
		cmocka_unit_test(lens_models_that_cannot_serve_are_refused),
		cmocka_unit_test(text_that_is_no_model_is_refused),
		cmocka_unit_test(every_bad_camera_has_its_message_in_one_run),
		cmocka_unit_test(a_rig_that_is_not_there_is_one_message),
		cmocka_unit_test(images_of_another_size_are_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
