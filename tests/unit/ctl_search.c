/*
 * What becomes of one camera's pictures, live and recorded alike, and how views of several cameras
 * become poses.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "calib_look.h"
#include "ctl/calibrate/calibrate_search.h"
#include "ctl/calibrate/calibrate_told.h"
#include "sim/render/render.h"

#define SHOT 5
#define MS INT64_C(1000000)

static struct sim_scene *scene;
static struct sim_renderer *renderer;

static const struct view_search_settings LIVE = {.blur_max_px = 2, .thorough = false};

static int set_up(void **state)
{
	(void)state;
	scene = look_scene(NULL, 4);
	return scene ? sim_renderer_create(&renderer, scene, 1, SIM_NOISE_FAST) : -1;
}

static int tear_down(void **state)
{
	(void)state;
	sim_renderer_destroy(renderer);
	sim_scene_destroy(scene);
	return 0;
}

static struct frame look(uint64_t shot)
{
	struct frame frame = {.format = PIXEL_GREY8, .shot = shot, .mid_exposure_ns = 0};

	frame.pixels = sim_render(renderer, shot, &frame.width_px, &frame.height_px);
	frame.stride_bytes = frame.width_px;
	return frame;
}

static void begin(struct view_search *search, const struct board *board,
		  const struct view_search_settings *settings)
{
	assert_int_equal(view_search_init(search, 0, board ? board : &scene->board.print, settings),
			 0);
}

static void run(struct view_search *search, const struct frame *frame)
{
	assert_int_equal(view_search_run(search, frame), 0);
}

static void expect_complaint(const struct view_search *search, const char *words)
{
	struct observed_camera camera = {.name = "ir1", .width_px = 1280, .height_px = 1024};
	struct picture_counts counts = search->counts;
	struct observations observations;
	struct diag diag = {0};

	assert_int_equal(observations_init(&observations, &scene->board.print, &camera, 1, &diag),
			 0);
	assert_int_equal(
		calibrate_check_pictures(&observations, &counts, &scene->board.print, 2, &diag),
		-EINVAL);
	assert_non_null(strstr(diag.text, words));
	observations_finish(&observations);
	diag_finish(&diag);
}

static void a_board_that_stands_still_is_searched_for_once(void **state)
{
	struct view_search search;

	(void)state;
	begin(&search, NULL, &LIVE);
	for (int i = 0; i < 4; i++) {
		struct frame frame = look(SHOT);

		run(&search, &frame);
	}
	struct frame later = look(SHOT + 30);
	run(&search, &later);
	assert_int_equal(search.counts.pictures, 2);
	assert_int_equal(search.counts.unchanged, 3);
	assert_int_equal(search.counts.good, 2);
	view_search_finish(&search);
}

static void mirror(uint8_t *pixels, const struct frame *frame)
{
	for (int y = 0; y < frame->height_px; y++)
		for (int x = 0; x < frame->width_px; x++)
			pixels[y * frame->width_px + x] =
				frame->pixels[y * frame->stride_bytes + frame->width_px - 1 - x];
}

static void a_mirrored_camera_is_told(void **state)
{
	struct frame frame = look(SHOT);
	uint8_t *pixels = malloc((size_t)frame.width_px * (size_t)frame.height_px);
	struct view_search search;

	(void)state;
	mirror(pixels, &frame);
	frame.pixels = pixels;
	begin(&search, NULL, &LIVE);
	run(&search, &frame);
	assert_true(search.counts.mirrored);
	expect_complaint(&search, "camera ir1: its pictures are mirrored");
	view_search_finish(&search);
	free(pixels);
}

static void another_board_is_told(void **state)
{
	struct board other = scene->board.print;
	struct frame frame = look(SHOT);
	struct view_search search;

	(void)state;
	other.squares_x = 8;
	begin(&search, &other, &LIVE);
	run(&search, &frame);
	assert_int_equal(search.counts.other, 1);
	expect_complaint(&search, "show another board");
	view_search_finish(&search);
}

static void a_blurred_camera_is_told(void **state)
{
	const struct view_search_settings strict = {.blur_max_px = 0.31, .thorough = false};
	struct frame frame = look(SHOT);
	struct view_search search;

	(void)state;
	begin(&search, NULL, &strict);
	run(&search, &frame);
	assert_int_equal(search.counts.blurred, 1);
	expect_complaint(&search, "1 of 1 views are blurred");
	view_search_finish(&search);
}

static void a_camera_without_pictures_is_told(void **state)
{
	struct view_search search;

	(void)state;
	begin(&search, NULL, &LIVE);
	expect_complaint(&search, "camera ir1: no picture of it came");
	view_search_finish(&search);
}

static void a_picture_of_another_size_is_damaged(void **state)
{
	struct frame frame = look(SHOT);
	struct view_search search;

	(void)state;
	begin(&search, NULL, &LIVE);
	run(&search, &frame);
	frame.height_px /= 2;
	run(&search, &frame);
	assert_int_equal(search.counts.damaged, 1);
	assert_int_equal(search.counts.pictures, 1);
	view_search_finish(&search);
}

/* Two cameras that see the same, exposed so much apart. */
static uint32_t poses_of(int64_t apart_ns, struct picture_counts counts[2])
{
	struct observed_camera cameras[2] = {{"ir0", 1280, 1024}, {"ir1", 1280, 1024}};
	struct view_search searches[2], *both[2] = {&searches[0], &searches[1]};
	struct observations observations;

	for (uint32_t c = 0; c < 2; c++) {
		struct frame frame = look(SHOT);

		frame.mid_exposure_ns = c * apart_ns;
		assert_int_equal(view_search_init(&searches[c], c, &scene->board.print, &LIVE), 0);
		run(&searches[c], &frame);
	}
	assert_int_equal(observations_init(&observations, &scene->board.print, cameras, 2, NULL),
			 0);
	assert_int_equal(views_put_together(&observations, both, counts), 0);
	uint32_t poses = observations_pose_count(&observations);
	observations_finish(&observations);
	view_search_finish(&searches[0]);
	view_search_finish(&searches[1]);
	return poses;
}

static void cameras_that_were_exposed_together_share_a_pose(void **state)
{
	struct picture_counts counts[2];

	(void)state;
	assert_int_equal(poses_of(MS / 10, counts), 1);
	assert_int_equal(counts[1].apart, 0);
	assert_int_equal(poses_of(2 * MS, counts), 2);
	assert_int_equal(counts[1].apart, 1);
	assert_float_equal(counts[1].apart_ms, 2, 1e-9);
}

/* Red is half as bright and blue a quarter, wherever the pixel stands in the mosaic. */
static void corners_stand_in_a_mosaic_where_they_stand_in_grey(void **state)
{
	static const int quarters[2][2] = {{2, 4}, {4, 1}};
	struct frame frame = look(SHOT);
	uint8_t *mosaic = malloc((size_t)frame.width_px * (size_t)frame.height_px);
	struct view_search grey, colour;
	double sum = 0;
	int count = 0;

	(void)state;
	for (int y = 0; y < frame.height_px; y++)
		for (int x = 0; x < frame.width_px; x++)
			mosaic[y * frame.width_px + x] =
				(uint8_t)(frame.pixels[y * frame.width_px + x] *
					  quarters[y & 1][x & 1] / 4);
	begin(&grey, NULL, &LIVE);
	begin(&colour, NULL, &LIVE);
	run(&grey, &frame);
	frame.pixels = mosaic;
	frame.format = PIXEL_BAYER_RG8;
	run(&colour, &frame);
	assert_int_equal(colour.corners.state, CORNERS_GOOD);
	for (int i = 0; i < board_corner_count(&scene->board.print); i++) {
		double off_px = hypot(grey.corners.px[i][0] - colour.corners.px[i][0],
				      grey.corners.px[i][1] - colour.corners.px[i][1]);

		if (isnan(off_px))
			continue;
		sum += off_px * off_px;
		count++;
	}
	assert_in_range(count, 40, BOARD_CORNER_MAX);
	assert_true(sqrt(sum / count) < 0.06);
	view_search_finish(&grey);
	view_search_finish(&colour);
	free(mosaic);
}

/* The picture at half its size, so that the squares are too small to be read at a quarter. */
static void a_small_board_is_found_at_the_pictures_own_size(void **state)
{
	struct view_search search;
	int found = 0;

	(void)state;
	begin(&search, NULL, &LIVE);
	for (uint64_t shot = SHOT; shot < SHOT + 60; shot += 12) {
		struct frame frame = look(shot);
		int width = frame.width_px / 2, height = frame.height_px / 2;
		uint8_t *half = malloc((size_t)width * (size_t)height);

		for (int y = 0; y < height; y++)
			for (int x = 0; x < width; x++) {
				const uint8_t *p =
					frame.pixels + 2 * y * frame.stride_bytes + 2 * x;

				half[y * width + x] =
					(uint8_t)((p[0] + p[1] + p[frame.stride_bytes] +
						   p[frame.stride_bytes + 1]) /
						  4);
			}
		frame.pixels = half;
		frame.width_px = frame.stride_bytes = width;
		frame.height_px = height;
		run(&search, &frame);
		found = (int)search.counts.good;
		free(half);
	}
	assert_true(search.small);
	assert_in_range(found, 4, 5);
	view_search_finish(&search);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_board_that_stands_still_is_searched_for_once),
		cmocka_unit_test(a_small_board_is_found_at_the_pictures_own_size),
		cmocka_unit_test(a_mirrored_camera_is_told),
		cmocka_unit_test(another_board_is_told),
		cmocka_unit_test(a_blurred_camera_is_told),
		cmocka_unit_test(a_camera_without_pictures_is_told),
		cmocka_unit_test(a_picture_of_another_size_is_damaged),
		cmocka_unit_test(cameras_that_were_exposed_together_share_a_pose),
		cmocka_unit_test(corners_stand_in_a_mosaic_where_they_stand_in_grey),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
