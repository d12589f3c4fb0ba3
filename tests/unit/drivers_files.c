/*
 * Recordings as cameras: what comes out is what was put in.
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

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(unpaced_frames_are_as_recorded),
		cmocka_unit_test(columns_but_time_and_file_are_optional),
		cmocka_unit_test(missing_frames_do_not_stretch_the_period),
		cmocka_unit_test(every_kind_of_image_gives_the_same_pixels),
		cmocka_unit_test(colour_is_delivered_where_it_is_wanted),
		cmocka_unit_test(grey_files_are_a_mosaic_where_one_is_wanted),
		cmocka_unit_test(paced_cameras_keep_their_times_together),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
