/*
 * Corners found in rendered pictures are where the truth has them.
 */
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "calib/board/homography.h"
#include "calib/board/tags.h"
#include "calib_look.h"
#include "config/board_pattern.h"
#include "sim/render/render.h"

#define CAMERAS 4

static struct sim_scene *make_scene(const char *optics)
{
	struct sim_scene *scene = look_scene(optics, CAMERAS);

	assert_non_null(scene);
	return scene;
}

static void corners_are_where_the_truth_has_them(const char *optics)
{
	const struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct sim_scene *scene = make_scene(optics);
	struct corner_finder *finder;
	struct look look = {0};

	assert_int_equal(corner_finder_create(&finder, &scene->board.print, &settings), 0);
	for (uint32_t c = 0; c < CAMERAS; c++)
		assert_int_equal(look_at(&look, finder, scene, c, 3, 37), 0);
	assert_true(look.measured > 300);
	assert_true(sqrt(look.sum / look.measured) < 0.03);
	assert_true(look.worst_px < 0.2);
	assert_true(fabs(look.mean[0] / look.measured) < 0.01); /* no half pixel is lost */
	assert_true(fabs(look.mean[1] / look.measured) < 0.01);
	assert_true(look.found > 0.98 * look.in_sight);
	corner_finder_destroy(finder);
	sim_scene_destroy(scene);
}

static void corners_of_gaussian_pictures_are_right(void **state)
{
	(void)state;
	corners_are_where_the_truth_has_them("gaussian");
}

static void corners_of_tailed_pictures_are_right(void **state)
{
	(void)state;
	corners_are_where_the_truth_has_them("tailed");
}

/* One picture of camera 1, whole board in sight. */
static uint8_t *render_one(const struct sim_scene *scene, struct grey_image *image)
{
	struct sim_renderer *renderer;
	int width_px, height_px;

	assert_int_equal(sim_renderer_create(&renderer, scene, 1, SIM_NOISE_FULL), 0);
	const uint8_t *pixels = sim_render(renderer, 42, &width_px, &height_px);
	uint8_t *copy = malloc((size_t)(width_px * height_px));
	assert_non_null(copy);
	memcpy(copy, pixels, (size_t)(width_px * height_px));
	*image = (struct grey_image){copy, width_px, height_px, width_px, 8};
	sim_renderer_destroy(renderer);
	return copy;
}

static enum corners_state state_of(const struct board *board, const struct grey_image *image,
				   struct corners *corners)
{
	const struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct corner_finder *finder;

	assert_int_equal(corner_finder_create(&finder, board, &settings), 0);
	assert_int_equal(corner_finder_run(finder, image, corners), 0);
	corner_finder_destroy(finder);
	return corners->state;
}

static void tags_are_in_our_pixels(void **state)
{
	(void)state;
	struct sim_scene *scene = make_scene("gaussian");
	const struct board *board = &scene->board.print;
	struct exposure exposure = scene_exposure(scene, 1, 42);
	struct pose rt_stage_board = sim_board_pose(&scene->board, exposure.mid_s);
	static struct tags tags;
	struct tag_finder *finder;
	struct grey_image image;
	double sum[2] = {0};
	int count = 0;

	uint8_t *pixels = render_one(scene, &image);
	assert_int_equal(tag_finder_create(&finder, board), 0);
	assert_int_equal(tag_finder_run(finder, &image, 1, &tags), 0);
	for (int i = 0; i < board_tag_count(board); i++) {
		double corner_m[2], edge_m, px[2], true_px[2];

		if (!tags.tags[i].found)
			continue;
		board_tag_place(board, i, corner_m, &edge_m);
		double middle_m[2] = {corner_m[0] + edge_m / 2, corner_m[1] + edge_m / 2};
		struct vec3 middle = board_point_m(board, middle_m[0], middle_m[1]);
		assert_true(homography_apply(tags.tags[i].h, middle_m, px));
		assert_true(sim_camera_project(&scene->cameras[1],
					       pose_apply(&rt_stage_board, middle), true_px));
		sum[0] += px[0] - true_px[0];
		sum[1] += px[1] - true_px[1];
		count++;
	}
	assert_true(count > 40);
	assert_true(fabs(sum[0] / count) < 0.1 && fabs(sum[1] / count) < 0.1);
	tag_finder_destroy(finder);
	free(pixels);
	sim_scene_destroy(scene);
}

static void pictures_of_another_board_are_refused(void **state)
{
	(void)state;
	struct sim_scene *scene = make_scene("gaussian");
	struct board board = scene->board.print;
	static struct corners corners;
	struct grey_image image;
	uint8_t *pixels = render_one(scene, &image);

	assert_int_equal(state_of(&board, &image, &corners), CORNERS_GOOD);
	board.squares_x--; /* the same tags in other squares */
	assert_int_equal(state_of(&board, &image, &corners), CORNERS_OTHER_BOARD);
	board = scene->board.print;
	board.first_id = 300;
	assert_int_equal(state_of(&board, &image, &corners), CORNERS_OTHER_BOARD);
	free(pixels);
	sim_scene_destroy(scene);
}

static void a_mirrored_picture_is_told_from_an_empty_one(void **state)
{
	(void)state;
	const struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct sim_scene *scene = make_scene("gaussian");
	struct corner_finder *finder;
	static struct corners corners;
	struct grey_image image;
	uint8_t *pixels = render_one(scene, &image);
	bool mirrored;

	assert_int_equal(corner_finder_create(&finder, &scene->board.print, &settings), 0);
	for (int y = 0; y < image.height_px; y++)
		for (int x = 0; x < image.width_px / 2; x++) {
			uint8_t *left = pixels + y * image.width_px + x;
			uint8_t *right = pixels + (y + 1) * image.width_px - 1 - x;
			uint8_t kept = *left;

			*left = *right;
			*right = kept;
		}
	assert_int_equal(corner_finder_run(finder, &image, &corners), 0);
	assert_int_equal(corners.state, CORNERS_NO_BOARD);
	assert_int_equal(corner_finder_is_mirrored(finder, &image, &mirrored), 0);
	assert_true(mirrored);
	memset(pixels, 30, (size_t)(image.width_px * image.height_px));
	assert_int_equal(corner_finder_is_mirrored(finder, &image, &mirrored), 0);
	assert_false(mirrored);
	corner_finder_destroy(finder);
	free(pixels);
	sim_scene_destroy(scene);
}

/* Every pixel becomes the mean of the `length` from it to the right, as a motion would make it. */
static void smear(uint8_t *pixels, const struct grey_image *image, int length)
{
	for (int y = 0; y < image->height_px; y++)
		for (int x = 0; x + length <= image->width_px; x++) {
			uint8_t *at = pixels + y * image->width_px + x;
			int sum = 0;

			for (int k = 0; k < length; k++)
				sum += at[k];
			*at = (uint8_t)(sum / length);
		}
}

static void blurred_views_are_refused(void **state)
{
	(void)state;
	struct sim_scene *scene = make_scene("gaussian");
	static struct corners sharp, smeared;
	struct grey_image image;
	uint8_t *pixels = render_one(scene, &image);

	assert_int_equal(state_of(&scene->board.print, &image, &sharp), CORNERS_GOOD);
	smear(pixels, &image, 3);
	assert_int_equal(state_of(&scene->board.print, &image, &smeared), CORNERS_GOOD);
	/* variances add: of a mean over 3 pixels, 8 / 12 */
	assert_float_equal(smeared.blur_px, sqrt(sharp.blur_px * sharp.blur_px + 8 / 12.0), 0.1);
	smear(pixels, &image, 8);
	assert_int_equal(state_of(&scene->board.print, &image, &smeared), CORNERS_BLURRED);
	free(pixels);
	sim_scene_destroy(scene);
}

struct job {
	const struct board *board;
	const struct grey_image *image;
	struct corners corners;
};

static void *find(void *user)
{
	struct job *job = user;

	state_of(job->board, job->image, &job->corners);
	return NULL;
}

static void threads_find_the_same_corners(void **state)
{
	(void)state;
	struct sim_scene *scene = make_scene("gaussian");
	static struct job jobs[3];
	pthread_t threads[3];
	struct grey_image image;
	uint8_t *pixels = render_one(scene, &image);

	for (int i = 0; i < 3; i++) {
		jobs[i].board = &scene->board.print;
		jobs[i].image = &image;
		assert_int_equal(pthread_create(&threads[i], NULL, find, &jobs[i]), 0);
	}
	for (int i = 0; i < 3; i++)
		pthread_join(threads[i], NULL);
	assert_true(jobs[0].corners.found_count > 80);
	for (int i = 1; i < 3; i++)
		assert_memory_equal(jobs[i].corners.px, jobs[0].corners.px,
				    sizeof(jobs[0].corners.px));
	free(pixels);
	sim_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(corners_of_gaussian_pictures_are_right),
		cmocka_unit_test(corners_of_tailed_pictures_are_right),
		cmocka_unit_test(tags_are_in_our_pixels),
		cmocka_unit_test(pictures_of_another_board_are_refused),
		cmocka_unit_test(a_mirrored_picture_is_told_from_an_empty_one),
		cmocka_unit_test(blurred_views_are_refused),
		cmocka_unit_test(threads_find_the_same_corners),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
