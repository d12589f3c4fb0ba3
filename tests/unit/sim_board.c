/*
 * The calibration board: its picture is where the truth says, tags and all.
 */
#include "sim/board/board.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include "sim/board/board_view.h"
#include "sim/render/hd_render.h"
#include "sim/render/render.h"
#include "sim/world/scene_parts.h"

#define IR_COUNT 4
#define SADDLE_HALF_PX 8 /* of the window around a corner; no other line may come nearer */

static struct sim_scene *make(uint64_t seed, int64_t hd_row_ns)
{
	const struct sim_options options = {.scene = "board",
					    .seed = seed,
					    .camera_count = IR_COUNT,
					    .hd_camera_count = 1,
					    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS,
					    .hd_row_ns = hd_row_ns};
	struct diag diag = {0};
	struct sim_scene *scene;

	assert_int_equal(sim_scene_create(&scene, &options, &diag), 0);
	return scene;
}

/* The board's light on every pixel, without noise and steps of grey, and without its tags, which
 * would reach into the corners' windows. */
static void add_light(float *light, const struct sim_scene *scene, uint32_t c, uint64_t shot,
		      bool blank)
{
	const struct sim_camera *camera = &scene->cameras[c];
	struct exposure exposure = scene_exposure(scene, c, shot);
	static struct board_art art;
	static struct board_view view;
	static float cover[2048];

	assert_int_equal(board_art_init(&art, &scene->board), 0);
	memset(art.pattern.cells, 0, sizeof(art.pattern.cells));
	if (blank)
		art.pattern.board.squares_x = 0;
	board_view_init(&view, &scene->board, &art, camera, 0.9, camera->range_m);
	board_view_begin(&view, &exposure);
	for (int y = view.box.y0; y < view.box.y1; y++)
		board_view_row(&view, y, light + y * camera->width_px + view.box.x0, cover);
}

/* The print over blank paper: what is left does not know how the light falls. */
static float *render_print(const struct sim_scene *scene, uint32_t c, uint64_t shot)
{
	size_t count = (size_t)(scene->cameras[c].width_px * scene->cameras[c].height_px);
	float *light = calloc(count, sizeof(*light)), *blank = calloc(count, sizeof(*blank));

	add_light(light, scene, c, shot, false);
	add_light(blank, scene, c, shot, true);
	for (size_t i = 0; i < count; i++)
		light[i] = blank[i] > 0 ? light[i] / blank[i] : 1;
	free(blank);
	return light;
}

/* Around a corner every gradient is at right angles to the way there (Foerstner). */
static void find_saddle(const float *light, int width_px, double at[2])
{
	for (int again = 0; again < 40; again++) {
		double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;
		int x0 = (int)lround(at[0]), y0 = (int)lround(at[1]);

		for (int y = y0 - SADDLE_HALF_PX; y <= y0 + SADDLE_HALF_PX; y++)
			for (int x = x0 - SADDLE_HALF_PX; x <= x0 + SADDLE_HALF_PX; x++) {
				const float *p = light + y * width_px + x;
				double gx = p[1] - p[-1], gy = p[width_px] - p[-width_px];
				double dx = x - at[0], dy = y - at[1];
				double w = exp(-6 * (dx * dx + dy * dy) /
					       (SADDLE_HALF_PX * SADDLE_HALF_PX));

				xx += w * gx * gx;
				xy += w * gx * gy;
				yy += w * gy * gy;
				bx += w * gx * (gx * dx + gy * dy);
				by += w * gy * (gx * dx + gy * dy);
			}
		double determinant = xx * yy - xy * xy;

		at[0] += (yy * bx - xy * by) / determinant;
		at[1] += (xx * by - xy * bx) / determinant;
	}
}

/* Pixels from a corner to the nearest line that does not pass through it. */
static double clearance_px(const struct board *print, const struct sim_board_corner *corners,
			   uint32_t index)
{
	uint32_t across = (uint32_t)print->squares_x - 1;
	uint32_t beside = index % across ? index - 1 : index + 1;
	uint32_t below = index >= across ? index - across : index + across;
	const double *at = corners[index].pixel;
	double a[2] = {corners[beside].pixel[0] - at[0], corners[beside].pixel[1] - at[1]};
	double b[2] = {corners[below].pixel[0] - at[0], corners[below].pixel[1] - at[1]};

	return fabs(a[0] * b[1] - a[1] * b[0]) / fmax(hypot(a[0], a[1]), hypot(b[0], b[1]));
}

static bool is_well_inside(const struct sim_camera *camera, const double pixel[2])
{
	const double margin_px = SADDLE_HALF_PX + 3;

	return pixel[0] > margin_px && pixel[1] > margin_px &&
	       pixel[0] < camera->width_px - margin_px && pixel[1] < camera->height_px - margin_px;
}

struct errors {
	uint32_t count;
	double sum2, worst, sum[2];
};

static void add_errors(struct errors *errors, const struct sim_scene *scene, uint32_t c,
		       uint64_t shot)
{
	static struct sim_board_corner corners[BOARD_CORNER_MAX];
	const struct sim_camera *camera = &scene->cameras[c];
	struct exposure exposure = scene_exposure(scene, c, shot);
	uint32_t count = (uint32_t)board_corner_count(&scene->board.print);
	float *light = render_print(scene, c, shot);

	sim_board_corners(&scene->board, camera, &exposure, corners);
	for (uint32_t i = 0; i < count; i++) {
		const double *truth = corners[i].pixel;
		double half_px = 0.5 * clearance_px(&scene->board.print, corners, i);

		if (!corners[i].seen || half_px < SADDLE_HALF_PX ||
		    !is_well_inside(camera, corners[i].pixel))
			continue;
		double found[2] = {truth[0] + 0.3, truth[1] - 0.3};

		find_saddle(light, camera->width_px, found);
		double off[2] = {found[0] - truth[0], found[1] - truth[1]};

		errors->count++;
		errors->sum2 += off[0] * off[0] + off[1] * off[1];
		errors->worst = fmax(errors->worst, hypot(off[0], off[1]));
		for (int k = 0; k < 2; k++)
			errors->sum[k] += off[k];
	}
	free(light);
}

static void check_errors(const struct errors *errors, uint32_t at_least)
{
	double rms = sqrt(errors->sum2 / errors->count);
	double bias = hypot(errors->sum[0], errors->sum[1]) / errors->count;

	print_message("# %u corners: rms %.4f px, worst %.4f px, bias %.5f px\n", errors->count,
		      rms, errors->worst, bias);
	assert_true(errors->count >= at_least);
	assert_true(errors->worst < 0.02);
	assert_true(bias < 0.002);
}

static void drawn_corners_are_where_the_truth_projects_them(void **state)
{
	struct errors errors = {0};

	(void)state;
	for (uint64_t seed = 1; seed <= 2; seed++) {
		struct sim_scene *scene = make(seed, 0);

		for (uint32_t c = 0; c < IR_COUNT; c++)
			for (uint64_t k = 0; k < 3; k++)
				add_errors(&errors, scene, c, 97 * k + 31 * c);
		sim_scene_destroy(scene);
	}
	check_errors(&errors, 900);
}

static void a_rolling_shutter_moves_picture_and_truth_alike(void **state)
{
	struct sim_scene *rolling = make(5, 12000), *global = make(5, 0);
	struct errors errors = {0};
	struct sim_board_corner a[BOARD_CORNER_MAX], b[BOARD_CORNER_MAX];
	double most_px = 0;

	(void)state;
	for (uint64_t k = 0; k < 2; k++) {
		uint64_t shot = sim_scene_hd_shot(rolling, 40 * k);
		struct exposure roll = scene_exposure(rolling, IR_COUNT, shot);
		struct exposure one = scene_exposure(global, IR_COUNT, shot);

		add_errors(&errors, rolling, IR_COUNT, shot);
		sim_board_corners(&rolling->board, &rolling->cameras[IR_COUNT], &roll, a);
		sim_board_corners(&global->board, &global->cameras[IR_COUNT], &one, b);
		for (uint32_t i = 0; i < (uint32_t)board_corner_count(&rolling->board.print); i++)
			if (a[i].seen && b[i].seen)
				most_px = fmax(most_px, hypot(a[i].pixel[0] - b[i].pixel[0],
							      a[i].pixel[1] - b[i].pixel[1]));
	}
	check_errors(&errors, 80);
	assert_true(most_px > 0.5);
	sim_scene_destroy(rolling);
	sim_scene_destroy(global);
}

static void the_whole_plate_is_drawn(void **state)
{
	struct sim_scene *scene = make(6, 0);
	static struct board_art art;
	static struct board_view view;

	(void)state;
	assert_int_equal(board_art_init(&art, &scene->board), 0);
	board_view_init(&view, &scene->board, &art, &scene->cameras[1], 0.9, 1.3);
	for (int i = 0; i < 100; i++) {
		struct exposure exposure = {.mid_s = 0.3 * i};
		struct pose rt = sim_board_pose(&scene->board, exposure.mid_s);

		board_view_begin(&view, &exposure);
		for (int corner = 0; corner < 4; corner++) {
			double x_m = corner & 1 ? art.high_m[0] : art.low_m[0], pixel[2];
			double y_m = corner & 2 ? art.high_m[1] : art.low_m[1];

			assert_true(sim_camera_project(
				&scene->cameras[1],
				pose_apply(&rt, board_point_m(&scene->board.print, x_m, y_m)),
				pixel));
			if (is_well_inside(&scene->cameras[1], pixel) &&
			    sim_board_faces(&rt, &scene->cameras[1]))
				assert_true(pixel[0] > view.box.x0 && pixel[0] < view.box.x1 &&
					    pixel[1] > view.box.y0 && pixel[1] < view.box.y1);
		}
	}
	sim_scene_destroy(scene);
}

/* A detector numbers pixels from the corner of the top-left one. */
static void check_tag(const struct sim_scene *scene, const struct sim_camera *camera,
		      const struct exposure *exposure, const apriltag_detection_t *tag)
{
	const struct board *print = &scene->board.print;
	struct pose rt = sim_board_pose(&scene->board, exposure->mid_s);
	double corner_m[2], edge_m, pixel[2];

	assert_in_range(tag->id - print->first_id, 0, board_tag_count(print) - 1);
	board_tag_place(print, tag->id - print->first_id, corner_m, &edge_m);
	struct vec3 middle =
		board_point_m(print, corner_m[0] + 0.5 * edge_m, corner_m[1] + 0.5 * edge_m);

	assert_true(sim_camera_project(camera, pose_apply(&rt, middle), pixel));
	assert_true(hypot(tag->c[0] - 0.5 - pixel[0], tag->c[1] - 0.5 - pixel[1]) < 0.7);
}

static void a_detector_reads_the_tags_where_they_are(void **state)
{
	struct sim_scene *scene = make(2, 0);
	apriltag_family_t *family = tag36h11_create();
	apriltag_detector_t *detector = apriltag_detector_create();
	uint32_t tag_count = 0, picture_count = 0;

	(void)state;
	apriltag_detector_add_family(detector, family);
	detector->quad_decimate = 1;
	for (uint32_t c = 0; c < IR_COUNT; c++) {
		struct exposure exposure = scene_exposure(scene, c, 40);
		struct sim_renderer *renderer;
		int width_px, height_px;

		assert_int_equal(sim_renderer_create(&renderer, scene, c, SIM_NOISE_FULL), 0);
		image_u8_t image = {
			.buf = (uint8_t *)sim_render(renderer, 40, &width_px, &height_px)};
		memcpy((int32_t *)&image.width, &width_px, 4);
		memcpy((int32_t *)&image.height, &height_px, 4);
		memcpy((int32_t *)&image.stride, &width_px, 4);
		zarray_t *found = apriltag_detector_detect(detector, &image);

		for (int i = 0; i < zarray_size(found); i++) {
			apriltag_detection_t *tag;

			zarray_get(found, i, &tag);
			check_tag(scene, &scene->cameras[c], &exposure, tag);
			tag_count++;
		}
		picture_count += zarray_size(found) > 0;
		apriltag_detections_destroy(found);
		sim_renderer_destroy(renderer);
	}
	print_message("# %u tags in %u pictures\n", tag_count, picture_count);
	assert_true(picture_count == IR_COUNT);
	assert_true(tag_count >= IR_COUNT * 54 * 3 / 4);
	apriltag_detector_destroy(detector);
	tag36h11_destroy(family);
	sim_scene_destroy(scene);
}

static void the_board_comes_everywhere_and_is_seen_from_all_sides(void **state)
{
	struct sim_scene *scene = make(4, 0);
	double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9};
	uint32_t seen[IR_COUNT] = {0};
	struct sim_board_corner corners[BOARD_CORNER_MAX];

	(void)state;
	for (int i = 0; i < 300; i++) {
		struct exposure exposure = {.mid_s = 0.1 * i};
		struct pose rt = sim_board_pose(&scene->board, exposure.mid_s);

		for (int k = 0; k < 3; k++) {
			low[k] = fmin(low[k], (&rt.t.x)[k]);
			high[k] = fmax(high[k], (&rt.t.x)[k]);
		}
		for (uint32_t c = 0; c < IR_COUNT; c++) {
			sim_board_corners(&scene->board, &scene->cameras[c], &exposure, corners);
			for (uint32_t j = 0; j < (uint32_t)board_corner_count(&scene->board.print);
			     j++)
				seen[c] += corners[j].seen;
		}
	}
	for (uint32_t c = 0; c < IR_COUNT; c++)
		assert_true(seen[c] > 300 * (uint32_t)board_corner_count(&scene->board.print) / 2);
	assert_true(high[0] - low[0] > 0.3 && high[1] - low[1] > 0.12 && high[2] - low[2] > 0.2);
	sim_scene_destroy(scene);
}

static void the_same_shot_gives_the_same_board_whatever_came_before(void **state)
{
	struct sim_scene *scene = make(3, 0);
	struct sim_renderer *a, *b;
	int width_px, height_px;

	(void)state;
	assert_int_equal(sim_renderer_create(&a, scene, 1, SIM_NOISE_FAST), 0);
	assert_int_equal(sim_renderer_create(&b, scene, 1, SIM_NOISE_FAST), 0);
	for (uint64_t shot = 0; shot < 3; shot++)
		sim_render(a, shot, &width_px, &height_px);
	const uint8_t *first = sim_render(a, 50, &width_px, &height_px);
	const uint8_t *second = sim_render(b, 50, &width_px, &height_px);

	assert_memory_equal(first, second, (size_t)width_px * (size_t)height_px);
	sim_renderer_destroy(a);
	sim_renderer_destroy(b);
	sim_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(drawn_corners_are_where_the_truth_projects_them),
		cmocka_unit_test(a_rolling_shutter_moves_picture_and_truth_alike),
		cmocka_unit_test(the_whole_plate_is_drawn),
		cmocka_unit_test(a_detector_reads_the_tags_where_they_are),
		cmocka_unit_test(the_board_comes_everywhere_and_is_seen_from_all_sides),
		cmocka_unit_test(the_same_shot_gives_the_same_board_whatever_came_before),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
