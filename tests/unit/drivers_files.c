/*
 * Recordings as cameras: what comes out is what was put in, and every way to spoil a recording has
 * a message that names file and line.
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

#define WIDTH_PX 40
#define HEIGHT_PX 32

static char dir[] = "/tmp/drivers_filesXXXXXX";
static struct camera *camera;
static struct camera_mode granted;

static const char *in_dir(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "%s/%s", dir, name);
	return path;
}

static void write_bytes(const char *name, const void *bytes, size_t size)
{
	FILE *file = fopen(in_dir(name), "w");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, size, file), size);
	assert_int_equal(fclose(file), 0);
}

static void write_text(const char *name, const char *text)
{
	write_bytes(name, text, strlen(text));
}

static uint8_t grey_at(int x, int y, int image)
{
	return (uint8_t)(x * 3 + y * 5 + image);
}

/* P5 or P6; the RGB pixels are (grey, grey, grey). */
static void write_pnm(const char *name, int channels, int image)
{
	uint8_t bytes[64 + WIDTH_PX * HEIGHT_PX * 3];
	int used = sprintf((char *)bytes, "P%d\n# a comment\n%d %d\n255\n", channels == 3 ? 6 : 5,
			   WIDTH_PX, HEIGHT_PX);

	for (int y = 0; y < HEIGHT_PX; y++)
		for (int x = 0; x < WIDTH_PX; x++)
			for (int c = 0; c < channels; c++)
				bytes[used++] = grey_at(x, y, image);
	write_bytes(name, bytes, (size_t)used);
}

static void write_png(const char *name, int colour_type, int depth, int image)
{
	png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
	png_infop info = png_create_info_struct(png);
	const png_color palette[2] = {{0, 0, 0}, {255, 255, 255}};
	uint8_t row[WIDTH_PX * 8] = {0};
	FILE *file = fopen(in_dir(name), "w");
	int channels = colour_type == PNG_COLOR_TYPE_RGB    ? 3
		       : colour_type == PNG_COLOR_TYPE_RGBA ? 4
							    : 1;

	assert_non_null(file);
	png_init_io(png, file);
	png_set_IHDR(png, info, WIDTH_PX, HEIGHT_PX, depth, colour_type, PNG_INTERLACE_NONE,
		     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
	if (colour_type == PNG_COLOR_TYPE_PALETTE)
		png_set_PLTE(png, info, palette, 2);
	png_set_gAMA(png, info, 0.3); /* must not change a pixel */
	png_write_info(png, info);
	for (int y = 0; y < HEIGHT_PX; y++) {
		for (int x = 0; x < WIDTH_PX * channels; x++)
			row[x] = colour_type == PNG_COLOR_TYPE_PALETTE
					 ? 0
					 : grey_at(x / channels, y, image);
		png_write_row(png, row);
	}
	png_write_end(png, info);
	png_destroy_write_struct(&png, &info);
	fclose(file);
}

static int open_camera(const struct camera_driver *driver, struct diag *diag)
{
	int err = driver->open(&camera, dir + strlen("/tmp/"), "/tmp", diag);

	return err;
}

static void start_with(const struct camera_driver *driver, enum pixel_format format)
{
	const struct camera_mode wanted = {.format = format};
	struct diag diag = {0};

	assert_int_equal(open_camera(driver, &diag), 0);
	assert_int_equal(driver->configure(camera, &wanted, &granted, &diag), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	assert_null(diag.text);
}

static void finish(void)
{
	camera->driver->stop(camera);
	camera->driver->close(camera);
	camera = NULL;
}

static int next(struct frame *frame)
{
	return camera->driver->acquire(camera, NS_PER_S, frame);
}

static void expect_grey(const struct frame *frame, int image)
{
	assert_int_equal(frame->format, PIXEL_GREY8);
	assert_int_equal(frame->width_px, WIDTH_PX);
	assert_int_equal(frame->height_px, HEIGHT_PX);
	for (int y = 0; y < HEIGHT_PX; y++)
		for (int x = 0; x < WIDTH_PX; x++)
			assert_int_equal(frame->pixels[y * frame->stride_bytes + x],
					 grey_at(x, y, image));
}

static void unpaced_frames_are_as_recorded(void **state)
{
	struct frame frame;

	(void)state;
	write_pnm("a.pgm", 1, 0);
	write_pnm("b.pgm", 1, 7);
	/* columns in another order, blanks, CRLF, a byte order mark, an empty line */
	write_text("frames.csv", "\xef\xbb\xbf file , mid_exposure_ns,shot, uncertainty_ns\r\n"
				 "a.pgm, 1000, 5, 20\r\n\r\nb.pgm,9000,6,30\r\n");
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	assert_int_equal(granted.width_px, WIDTH_PX);
	assert_int_equal(granted.height_px, HEIGHT_PX);
	assert_int_equal(granted.period_ns, 8000);
	assert_int_equal(next(&frame), 0);
	expect_grey(&frame, 0);
	assert_int_equal(frame.shot, 5);
	assert_int_equal(frame.mid_exposure_ns, 1000);
	assert_int_equal(frame.uncertainty_ns, 20);
	assert_int_equal(frame.device_seq, 0);
	camera->driver->release(camera, &frame);
	assert_int_equal(next(&frame), 0);
	expect_grey(&frame, 7);
	assert_int_equal(frame.shot, 6);
	camera->driver->release(camera, &frame);
	assert_int_equal(next(&frame), -ENODATA);
	assert_int_equal(next(&frame), -ENODATA);
	assert_string_equal(files_camera_problem(camera), "");
	finish();
}

static void columns_but_time_and_file_are_optional(void **state)
{
	struct frame frame;

	(void)state;
	write_pnm("a.pgm", 1, 0);
	write_text("frames.csv", "mid_exposure_ns,file\n4611686018427387903,a.pgm");
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	assert_int_equal(next(&frame), 0);
	assert_true(frame.shot == UINT64_MAX);
	assert_true(frame.mid_exposure_ns == INT64_C(4611686018427387903));
	assert_int_equal(frame.uncertainty_ns, 0);
	finish();
}

/* Else its neighbours would be taken for one shot. */
static void missing_frames_do_not_stretch_the_period(void **state)
{
	(void)state;
	write_pnm("a.pgm", 1, 0);
	write_text("frames.csv", "mid_exposure_ns,file\n1000,a.pgm\n17000,a.pgm\n25002,a.pgm\n"
				 "33000,a.pgm\n57000,a.pgm\n64999,a.pgm\n73000,a.pgm\n");
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	assert_int_equal(granted.period_ns, 8000);
	finish();
	write_text("frames.csv", "mid_exposure_ns,file\n1000,a.pgm\n");
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	assert_int_equal(granted.period_ns, 0);
	finish();
}

static void every_kind_of_image_gives_the_same_pixels(void **state)
{
	struct frame frame;
	char text[32 + WIDTH_PX * HEIGHT_PX * 4];
	int used = sprintf(text, "P2 %d %d 255\n", WIDTH_PX, HEIGHT_PX);

	(void)state;
	for (int y = 0; y < HEIGHT_PX; y++)
		for (int x = 0; x < WIDTH_PX; x++)
			used += sprintf(text + used, "%d ", grey_at(x, y, 1));
	write_text("ascii.pgm", text);
	write_pnm("grey.pgm", 1, 1);
	write_pnm("colour.ppm", 3, 1);
	write_png("grey.png", PNG_COLOR_TYPE_GRAY, 8, 1);
	write_png("colour.png", PNG_COLOR_TYPE_RGB, 8, 1);
	write_text("frames.csv", "mid_exposure_ns,file\n1,ascii.pgm\n2,grey.pgm\n3,colour.ppm\n"
				 "4,grey.png\n5,colour.png\n");
	start_with(&files_camera_driver_unpaced, PIXEL_GREY8);
	for (int i = 0; i < 5; i++) {
		assert_int_equal(next(&frame), 0);
		expect_grey(&frame, 1);
		camera->driver->release(camera, &frame);
	}
	finish();
}

static void colour_is_delivered_where_it_is_wanted(void **state)
{
	struct frame frame;

	(void)state;
	write_pnm("colour.ppm", 3, 1);
	write_png("colour.png", PNG_COLOR_TYPE_RGB, 8, 1);
	write_pnm("grey.pgm", 1, 1);
	write_text("frames.csv", "mid_exposure_ns,file\n1,colour.ppm\n2,colour.png\n3,grey.pgm\n");
	start_with(&files_camera_driver_unpaced, PIXEL_RGB8);
	assert_int_equal(granted.format, PIXEL_RGB8);
	for (int i = 0; i < 2; i++) {
		assert_int_equal(next(&frame), 0);
		assert_int_equal(frame.format, PIXEL_RGB8);
		assert_int_equal(frame.stride_bytes, 3 * WIDTH_PX);
		for (int k = 0; k < 3 * WIDTH_PX; k++)
			assert_int_equal(frame.pixels[5 * frame.stride_bytes + k],
					 grey_at(k / 3, 5, 1));
		camera->driver->release(camera, &frame);
	}
	assert_int_equal(next(&frame), -EBADMSG);
	assert_non_null(strstr(files_camera_problem(camera), "/grey.pgm: is grey"));
	finish();
}

static void grey_files_are_a_mosaic_where_one_is_wanted(void **state)
{
	struct frame frame;

	(void)state;
	write_pnm("grey.pgm", 1, 1);
	write_pnm("colour.ppm", 3, 1);
	write_text("frames.csv", "mid_exposure_ns,file\n1,grey.pgm\n2,colour.ppm\n");
	start_with(&files_camera_driver_unpaced, PIXEL_BAYER_RG8);
	assert_int_equal(granted.format, PIXEL_BAYER_RG8);
	assert_int_equal(next(&frame), 0);
	assert_int_equal(frame.format, PIXEL_BAYER_RG8);
	assert_int_equal(frame.stride_bytes, WIDTH_PX);
	assert_int_equal(frame.pixels[5 * WIDTH_PX + 3], grey_at(3, 5, 1));
	camera->driver->release(camera, &frame);
	assert_int_equal(next(&frame), -EBADMSG);
	assert_non_null(strstr(files_camera_problem(camera), "/colour.ppm: is RGB"));
	finish();
}

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

static void paced_cameras_keep_their_times_together(void **state)
{
	const struct camera_driver *driver = &files_camera_driver;
	const struct camera_mode wanted = {0};
	struct camera *second;
	struct frame a, b;

	(void)state;
	write_pnm("a.pgm", 1, 0);
	/* the recording began at 5 s; the second camera runs on the same files */
	write_text("frames.csv", "mid_exposure_ns,file\n5000000000,a.pgm\n5020000000,a.pgm\n");
	int64_t start_ns = clock_now_ns();
	start_with(driver, PIXEL_GREY8);
	assert_int_equal(driver->open(&second, dir, NULL, NULL), 0);
	assert_int_equal(driver->configure(second, &wanted, &granted, NULL), 0);
	clock_sleep_until(clock_now_ns() + 30 * NS_PER_MS);
	assert_int_equal(driver->start(second, NULL), 0);
	if (clock_now_ns() - start_ns < 200 * NS_PER_MS) /* nothing is due yet */
		assert_int_equal(driver->acquire(camera, NS_PER_MS, &a), -ETIMEDOUT);
	for (int i = 0; i < 2; i++) {
		int64_t last_ns = i ? a.mid_exposure_ns : 0;

		assert_int_equal(next(&a), 0);
		assert_int_equal(driver->acquire(second, NS_PER_S, &b), 0);
		assert_true(a.mid_exposure_ns == b.mid_exposure_ns);
		assert_true(a.arrival_ns >= a.mid_exposure_ns);
		assert_true(clock_now_ns() - a.mid_exposure_ns < 5 * NS_PER_S);
		if (i)
			assert_int_equal(a.mid_exposure_ns - last_ns, 20000000);
		driver->release(camera, &a);
		driver->release(second, &b);
	}
	assert_int_equal(next(&a), -ENODATA);
	driver->stop(second);
	driver->close(second);
	finish();
}

static int make_dir(void **state)
{
	(void)state;
	return mkdtemp(dir) ? 0 : -1;
}

static int remove_dir(void **state)
{
	char command[64];

	(void)state;
	snprintf(command, sizeof(command), "rm -r %s", dir);
	return system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(unpaced_frames_are_as_recorded),
		cmocka_unit_test(columns_but_time_and_file_are_optional),
		cmocka_unit_test(missing_frames_do_not_stretch_the_period),
		cmocka_unit_test(every_kind_of_image_gives_the_same_pixels),
		cmocka_unit_test(colour_is_delivered_where_it_is_wanted),
		cmocka_unit_test(grey_files_are_a_mosaic_where_one_is_wanted),
		cmocka_unit_test(a_damaged_image_is_skipped_counted_and_named),
		cmocka_unit_test(a_missing_image_costs_one_picture),
		cmocka_unit_test(a_last_line_that_was_cut_off_is_told_and_left_out),
		cmocka_unit_test(png_files_of_other_kinds_are_named),
		cmocka_unit_test(bad_rows_are_all_named_in_one_run),
		cmocka_unit_test(file_names_stay_inside_the_directory),
		cmocka_unit_test(bad_headers_are_named),
		cmocka_unit_test(paced_cameras_keep_their_times_together),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
