/*
 * Every way to spoil a recording costs no more than it must, and has a message that names file and
 * line.
 */
#include "drivers/files/files.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "recording_dir.h"

/* Reads frames.csv with one row naming `bad` behind a good one. */
static void expect_damaged(const char *bad, const char *problem)
{
	struct frame frame;
	char text[128];

	write_pnm("a.pgm", 1, 0);
	snprintf(text, sizeof(text), "mid_exposure_ns,file\n1,a.pgm\n2,%s\n3,a.pgm\n", bad);
	write_text("frames.csv", text);
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	assert_int_equal(next(&frame), 0);
	camera->driver->release(camera, &frame);
	assert_int_equal(next(&frame), -EBADMSG);
	snprintf(text, sizeof(text), "%s/%s: %s", dir, bad, problem);
	assert_string_equal(files_camera_problem(camera), text);
	assert_int_equal(files_camera_damaged_count(camera), 1);
	assert_int_equal(next(&frame), 0); /* the recording goes on */
	expect_grey(&frame, 0);
	assert_int_equal(frame.device_seq, 2); /* and the gap shows */
	finish();
}

static void a_damaged_image_is_skipped_counted_and_named(void **state)
{
	(void)state;
	write_text("cut.pgm", "P5 40 32 255\n0123456789");
	expect_damaged("cut.pgm", "truncated: 10 of 1280 bytes of pixels");
	write_text("other.pgm", "P5 64 48 255\n");
	expect_damaged("other.pgm", "is 64x48, the first image is 40x32");
	write_text("deep.pgm", "P5 40 32 65535\n");
	expect_damaged("deep.pgm", "the PNM's maximum is not 255; convert it to 8 bits");
	write_text("kind.pgm", "P4 40 32\n");
	expect_damaged("kind.pgm", "neither PNG nor PNM of kind P2, P5 or P6");
	write_text("empty.pgm", "");
	expect_damaged("empty.pgm", "neither PNG nor PNM of kind P2, P5 or P6");
	write_text("huge.pgm", "P5 99999999999999999999 32 255\n");
	expect_damaged("huge.pgm", "the PNM header has no size of 1 to 16384 pixels");
	write_text("head.pgm", "P5 40 32 255");
	expect_damaged("head.pgm", "truncated behind the PNM header");
	write_text("text.pgm", "P2 40 32 255\n1 2 300");
	expect_damaged("text.pgm", "truncated, or a pixel is not from 0 to 255");
}

static void a_missing_image_costs_one_picture(void **state)
{
	(void)state;
	expect_damaged("gone.pgm", "No such file or directory");
}

/* As a recorder that was killed leaves it, at any place behind the first row. */
static void a_last_line_that_was_cut_off_is_told_and_left_out(void **state)
{
	static const char *const rows = "shot,mid_exposure_ns,uncertainty_ns,file\n"
					"1,1000,1,a.pgm\n2,2000,1,a.pgm\n";
	static const char *const cut[] = {"3", "3,", "3,3", "3,3000,", "3,3000,1", "3,3000,1,"};
	struct frame frame;
	char table[256];

	(void)state;
	write_pnm("a.pgm", 1, 0);
	for (size_t i = 0; i < sizeof(cut) / sizeof(*cut); i++) {
		snprintf(table, sizeof(table), "%s%s", rows, cut[i]);
		write_text("frames.csv", table);
		start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
		for (uint64_t shot = 1; shot <= 2; shot++) {
			assert_int_equal(next(&frame), 0);
			assert_int_equal(frame.shot, shot);
			camera->driver->release(camera, &frame);
		}
		assert_int_equal(next(&frame), -EBADMSG);
		assert_non_null(strstr(files_camera_problem(camera), "frames.csv:4: cut off"));
		assert_int_equal(next(&frame), -ENODATA);
		assert_int_equal(files_camera_damaged_count(camera), 1);
		finish();
	}
}

static void png_files_of_other_kinds_are_named(void **state)
{
	uint8_t bytes[4096];

	(void)state;
	write_png("deep.png", PNG_COLOR_TYPE_GRAY, 16, 1);
	expect_damaged("deep.png", "a PNG that has not 8 bits a channel; convert it to 8-bit grey "
				   "or RGB");
	write_png("flat.png", PNG_COLOR_TYPE_PALETTE, 8, 1);
	expect_damaged("flat.png", "a PNG with a palette; convert it to 8-bit grey or RGB");
	write_png("clear.png", PNG_COLOR_TYPE_RGBA, 8, 1);
	expect_damaged("clear.png", "a PNG with transparency; convert it to 8-bit grey or RGB");
	write_png("cut.png", PNG_COLOR_TYPE_GRAY, 8, 1);
	FILE *file = fopen(in_dir("cut.png"), "r");
	size_t size = fread(bytes, 1, sizeof(bytes), file);
	fclose(file);
	write_bytes("cut.png", bytes, size / 2);
	expect_damaged("cut.png", "damaged PNG: truncated");
	bytes[size - 14] ^= 1; /* the checksum of the pixels */
	write_bytes("cut.png", bytes, size);
	expect_damaged("cut.png", "damaged PNG: IDAT: CRC error");
}

static void expect_refused(const char *table, const char *messages)
{
	struct diag diag = {0};
	char found[2048] = "", *rest;

	write_pnm("a.pgm", 1, 0);
	write_text("frames.csv", table);
	assert_true(open_camera(&files_camera_driver_unpaced, &diag) < 0);
	for (char *line = strtok_r(diag.text, "\n", &rest); line;
	     line = strtok_r(NULL, "\n", &rest)) {
		assert_memory_equal(line, dir, strlen(dir));
		strcat(strcat(found, line + strlen(dir) + 1), "\n");
	}
	assert_string_equal(found, messages);
	diag_finish(&diag);
}

#define TABLE_HEAD "shot,mid_exposure_ns,uncertainty_ns,file\n1,10,1,a.pgm\n"

static void bad_rows_are_all_named_in_one_run(void **state)
{
	(void)state;
	expect_refused(TABLE_HEAD "x,20,1,a.pgm\n3,-5,1,a.pgm\n4,1e9,1,a.pgm\n"
				  "5,99999999999999999999,1,a.pgm\n6,60,,a.pgm\n7,70\n",
		       "frames.csv:3: shot: 'x' is not a whole number\n"
		       "frames.csv:4: mid_exposure_ns: '-5' is not a whole number\n"
		       "frames.csv:5: mid_exposure_ns: '1e9' is not a whole number\n"
		       "frames.csv:6: mid_exposure_ns: '99999999999999999999' is too large\n"
		       "frames.csv:7: uncertainty_ns: '' is not a whole number\n"
		       "frames.csv:8: uncertainty_ns: missing in this row\n");
	expect_refused(TABLE_HEAD "2,10,1,a.pgm\n",
		       "frames.csv:3: mid_exposure_ns: not later than in "
		       "the row before\n");
	expect_refused(TABLE_HEAD "1,20,1,a.pgm\n",
		       "frames.csv:3: shot: not above the shot of the row before\n");
}

static void file_names_stay_inside_the_directory(void **state)
{
	(void)state;
	expect_refused(TABLE_HEAD
		       "2,20,1,../a.pgm\n3,30,1,b/../../a\n4,40,1,/etc/passwd\n5,50,1,\n",
		       "frames.csv:3: file: '../a.pgm' leads out of the directory\n"
		       "frames.csv:4: file: 'b/../../a' leads out of the directory\n"
		       "frames.csv:5: file: '/etc/passwd' is an absolute path, expected one inside "
		       "the directory\n"
		       "frames.csv:6: file: '' is empty\n");
	expect_refused(TABLE_HEAD "2,20,1,missing.pgm\n3,30,1,.\n",
		       "frames.csv:3: file: 'missing.pgm' is not a file in this directory\n"
		       "frames.csv:4: file: '.' is not a file in this directory\n");
}

static void bad_headers_are_named(void **state)
{
	(void)state;
	expect_refused("shot,time,file\n", "frames.csv:1: mid_exposure_ns: the header has no such "
					   "column\n");
	expect_refused("mid_exposure_ns,file,file\n", "frames.csv:1: file: this column is there "
						      "twice\n");
	expect_refused("", "frames.csv: no frames in it; expected the header "
			   "shot,mid_exposure_ns,uncertainty_ns,file and a line per image\n");
	expect_refused("mid_exposure_ns,file\n", "frames.csv: no frames in it; expected the header "
						 "shot,mid_exposure_ns,uncertainty_ns,file and a "
						 "line per image\n");
	expect_refused("a,b,c,d,e,f,g,h,i,j,k,l,m,n,o,p,q\n",
		       "frames.csv:1: more than 16 columns\n");
	write_text("first.pgm", "P5 0 32 255\n");
	expect_refused("mid_exposure_ns,file\n1,first.pgm\n",
		       "first.pgm: the PNM header has no size of 1 to 16384 pixels\n");
	unlink(in_dir("frames.csv"));
	struct diag diag = {0};
	assert_int_equal(open_camera(&files_camera_driver_unpaced, &diag), -ENOENT);
	assert_non_null(strstr(diag.text, "/frames.csv: No such file or directory"));
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_damaged_image_is_skipped_counted_and_named),
		cmocka_unit_test(a_missing_image_costs_one_picture),
		cmocka_unit_test(a_last_line_that_was_cut_off_is_told_and_left_out),
		cmocka_unit_test(png_files_of_other_kinds_are_named),
		cmocka_unit_test(bad_rows_are_all_named_in_one_run),
		cmocka_unit_test(file_names_stay_inside_the_directory),
		cmocka_unit_test(bad_headers_are_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
