/*
 * What the HD cameras of a scene show: markers where the models say, a head behind them, in every
 * fourth shot.
 */
#include "sim/render/hd_render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "sim/render/spot.h"
#include "sim/sights.h"
#include "sim/world/scene_parts.h"
#include "sim/world/world.h"

#include "hd_spots.h"

#define IR_COUNT 4
#define APART_PX 16.0 /* markers nearer to each other spoil each other's windows */
#define ERROR_MAX_PX 0.1

static struct sim_scene *make(uint32_t hd_count, uint32_t phase)
{
	const struct sim_options options = {.scene = "talking",
					    .seed = 7,
					    .camera_count = IR_COUNT,
					    .hd_camera_count = hd_count,
					    .hd_phase = phase,
					    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS};
	struct diag diag = {0};
	struct sim_scene *scene;

	assert_int_equal(sim_scene_create(&scene, &options, &diag), 0);
	return scene;
}

struct seen {
	uint32_t count;
	double pixels[LABEL_MAX][2];
};

static void find_seen(const struct sim_scene *scene, uint32_t camera, uint64_t shot,
		      struct seen *seen)
{
	static struct sim_truth truth;
	double facing;

	scene_pose_markers(scene, (double)sim_scene_hd_mid_exposure_ns(scene, shot) * 1e-9, &truth);
	seen->count = 0;
	for (uint32_t m = 0; m < truth.marker_count; m++)
		if (scene_camera_sees(scene, &truth, camera, m, seen->pixels[seen->count],
				      &facing) &&
		    facing > 0.5)
			seen->count++;
}

static bool is_alone(const struct seen *seen, uint32_t index)
{
	for (uint32_t i = 0; i < seen->count; i++)
		if (i != index && hypot(seen->pixels[i][0] - seen->pixels[index][0],
					seen->pixels[i][1] - seen->pixels[index][1]) < APART_PX)
			return false;
	return true;
}

static void spots_are_where_the_models_project_the_markers(void **state)
{
	struct sim_scene *scene = make(3, 0);
	uint32_t checked = 0, off = 0;
	double sum2 = 0, bias[2] = {0, 0};
	static struct seen seen;

	(void)state;
	for (uint32_t c = IR_COUNT; c < IR_COUNT + 3; c++) {
		struct sim_hd_renderer *renderer;

		assert_int_equal(sim_hd_renderer_create(&renderer, scene, c), 0);
		for (uint64_t k = 0; k < 10; k++) {
			uint64_t shot = sim_scene_hd_shot(scene, 13 * k);
			struct hd_picture picture;

			picture.pixels = sim_hd_render(renderer, shot, &picture.width_px,
						       &picture.height_px);
			find_seen(scene, c, shot, &seen);
			for (uint32_t i = 0; i < seen.count; i++) {
				double found[2];

				if (!is_alone(&seen, i) ||
				    !hd_spot_is_on_even_skin(&picture, seen.pixels[i]))
					continue;
				hd_spot_centroid(&picture, seen.pixels[i], found);
				double error = hypot(found[0] - seen.pixels[i][0],
						     found[1] - seen.pixels[i][1]);
				checked++;
				sum2 += error * error;
				off += !(error < ERROR_MAX_PX);
				bias[0] += found[0] - seen.pixels[i][0];
				bias[1] += found[1] - seen.pixels[i][1];
			}
		}
		sim_hd_renderer_destroy(renderer);
	}
	print_message("# %u spots, rms %.3f px, %u off by more than %.1f px\n", checked,
		      sqrt(sum2 / checked), off, ERROR_MAX_PX);
	assert_true(checked > 350);
	assert_true(sqrt(sum2 / checked) < 0.05);
	assert_true(off * 100 <= checked); /* noise */
	assert_true(hypot(bias[0], bias[1]) / checked < 0.01);
	sim_scene_destroy(scene);
}

static void a_head_stands_out_from_a_dark_room(void **state)
{
	struct sim_scene *scene = make(1, 0);
	struct sim_hd_renderer *renderer;
	int width_px, height_px;
	double head[3] = {0}, middle[2];

	(void)state;
	assert_int_equal(sim_hd_renderer_create(&renderer, scene, IR_COUNT), 0);
	const uint8_t *pixels = sim_hd_render(renderer, 0, &width_px, &height_px);
	assert_int_equal(width_px, 1920);
	assert_int_equal(height_px, 1080);
	struct pose rt =
		motion_head(&scene->actors[0].motion, 1e-9 * (double)SIM_HD_AFTER_IR_NS, 0);
	assert_true(sim_camera_project(&scene->cameras[IR_COUNT], rt.t, middle));
	for (int y = -40; y < 40; y++) /* red, green, blue of the skin around the middle */
		for (int x = -40; x < 40; x++) {
			int u = (int)middle[0] + x, v = (int)middle[1] + y;

			head[(u & 1) + (v & 1)] +=
				pixels[v * width_px + u] / ((u & 1) == (v & 1) ? 1600.0 : 3200.0);
		}
	assert_true(head[0] > head[1] + 5 && head[1] > head[2] + 3); /* skin is reddish */
	assert_true(head[0] > 60 && pixels[50 * width_px + 50] < 40);
	sim_hd_renderer_destroy(renderer);
	sim_scene_destroy(scene);
}

static void the_same_shot_gives_the_same_picture_whatever_came_before(void **state)
{
	struct sim_scene *scene = make(2, 1);
	struct sim_hd_renderer *a, *b;
	int width_px, height_px;

	(void)state;
	assert_int_equal(sim_hd_renderer_create(&a, scene, IR_COUNT + 1), 0);
	assert_int_equal(sim_hd_renderer_create(&b, scene, IR_COUNT + 1), 0);
	for (uint64_t k = 0; k < 5; k++)
		sim_hd_render(a, sim_scene_hd_shot(scene, 40 * k), &width_px, &height_px);
	const uint8_t *first = sim_hd_render(a, 401, &width_px, &height_px);
	const uint8_t *second = sim_hd_render(b, 401, &width_px, &height_px);
	assert_memory_equal(first, second, (size_t)width_px * (size_t)height_px);
	sim_hd_renderer_destroy(a);
	sim_hd_renderer_destroy(b);
	sim_scene_destroy(scene);
}

/* Exactly, by asking for the whole scene at the row's time, again and again. */
static void find_exactly(const struct sim_scene *scene, uint64_t shot, uint32_t marker,
			 double pixel[2])
{
	const struct exposure exposure = scene_exposure(scene, IR_COUNT, shot);
	const struct sim_camera *camera = &scene->cameras[IR_COUNT];
	static struct sim_truth truth;
	double row = 540;

	for (int step = 0; step < 8; step++) {
		scene_pose_markers(scene, exposure_of_row_s(&exposure, row, camera->height_px),
				   &truth);
		assert_true(sim_camera_project(camera, truth.markers[marker].p_stage_m, pixel));
		row = pixel[1];
	}
}

static struct sim_options rolling_shutter(uint64_t seed)
{
	return (struct sim_options){.scene = "04-head-shake",
				    .seed = seed,
				    .camera_count = IR_COUNT,
				    .hd_camera_count = 1,
				    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS,
				    .hd_row_ns = 15000};
}

static void a_rolling_shutter_exposes_every_row_at_its_time(void **state)
{
	const struct sim_options options = rolling_shutter(7);
	static struct sim_sight rolling[LABEL_MAX], global[LABEL_MAX];
	struct sim_scene *scene;
	double most_px = 0, moved_px = 0;
	uint32_t count = 0;

	(void)state;
	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	for (uint64_t k = 30; k < 60; k += 5) {
		uint64_t shot = sim_scene_hd_shot(scene, k);

		assert_int_equal(sim_scene_sights(scene, IR_COUNT, shot, rolling), 0);
		scene->hd_row_ns = 0;
		assert_int_equal(sim_scene_sights(scene, IR_COUNT, shot, global), 0);
		scene->hd_row_ns = options.hd_row_ns;
		for (uint32_t m = 0; m < scene->layout.marker_count; m += 7) {
			double exact[2];

			if (!rolling[m].seen)
				continue;
			find_exactly(scene, shot, m, exact);
			count++;
			most_px = fmax(most_px, hypot(rolling[m].pixel[0] - exact[0],
						      rolling[m].pixel[1] - exact[1]));
			if (global[m].seen)
				moved_px = fmax(moved_px,
						hypot(rolling[m].pixel[0] - global[m].pixel[0],
						      rolling[m].pixel[1] - global[m].pixel[1]));
		}
	}
	print_message(
		"# %u markers: %.4f px from the exact place, %.2f px from a global shutter's\n",
		count, most_px, moved_px);
	assert_true(count > 30 && most_px < 0.05 && moved_px > 1);
	sim_scene_destroy(scene);
}

/* Centroids in pictures of a rolling shutter, against sights. */
static void spots_of_a_rolling_shutter_are_where_the_sights_are(void **state)
{
	const struct sim_options options = rolling_shutter(3);
	static struct sim_sight sights[LABEL_MAX];
	static struct seen seen;
	struct sim_hd_renderer *renderer;
	struct sim_scene *scene;
	double sum2 = 0;
	uint32_t checked = 0;

	(void)state;
	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	assert_int_equal(sim_hd_renderer_create(&renderer, scene, IR_COUNT), 0);
	for (uint64_t k = 20; k < 60; k += 4) {
		uint64_t shot = sim_scene_hd_shot(scene, k);
		struct hd_picture picture;

		picture.pixels =
			sim_hd_render(renderer, shot, &picture.width_px, &picture.height_px);
		assert_int_equal(sim_scene_sights(scene, IR_COUNT, shot, sights), 0);
		seen.count = 0;
		for (uint32_t m = 0; m < scene->layout.marker_count; m++)
			if (sights[m].seen)
				memcpy(seen.pixels[seen.count++], sights[m].pixel,
				       sizeof(sights[m].pixel));
		for (uint32_t i = 0; i < seen.count; i++) {
			double found[2];

			if (!is_alone(&seen, i) ||
			    !hd_spot_is_on_even_skin(&picture, seen.pixels[i]))
				continue;
			hd_spot_centroid(&picture, seen.pixels[i], found);
			checked++;
			sum2 += pow(found[0] - seen.pixels[i][0], 2) +
				pow(found[1] - seen.pixels[i][1], 2);
		}
	}
	print_message("# %u spots, rms %.3f px\n", checked, sqrt(sum2 / checked));
	assert_true(checked > 60 && sqrt(sum2 / checked) < 0.1);
	sim_hd_renderer_destroy(renderer);
	sim_scene_destroy(scene);
}

static void hd_cameras_leave_the_ir_cameras_and_the_truth_as_they_are(void **state)
{
	struct sim_scene *without = make(0, 0), *with = make(3, 0);
	static struct sim_truth a, b;

	(void)state;
	assert_memory_equal(without->cameras, with->cameras, IR_COUNT * sizeof(with->cameras[0]));
	sim_scene_truth(without, 1.5, &a);
	sim_scene_truth(with, 1.5, &b);
	assert_memory_equal(&a, &b, sizeof(a));
	sim_scene_destroy(without);
	sim_scene_destroy(with);
}

static void more_than_three_hd_cameras_are_refused(void **state)
{
	const struct sim_options options = {.hd_camera_count = 4};
	struct diag diag = {0};
	struct sim_scene *scene = NULL;

	(void)state;
	assert_int_not_equal(sim_scene_create(&scene, &options, &diag), 0);
	assert_null(scene);
	diag_finish(&diag);
}

/* Frames of camera hd0 of a world that began a while ago. */
static void live_frames_are_those_of_every_fourth_shot(void **state)
{
	const struct sim_options options = {.scene = "rest",
					    .camera_count = IR_COUNT,
					    .rate_hz = 120,
					    .hd_camera_count = 1,
					    .hd_phase = 3,
					    .hd_row_ns = 10000,
					    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS};
	struct camera_mode wanted = {.format = PIXEL_BAYER_RG8}, granted;
	struct diag diag = {0};
	struct camera *camera;
	struct frame frame;
	uint64_t first = 0;

	(void)state;
	assert_int_equal(sim_world_open(&options, clock_now_ns() - NS_PER_S, &diag), 0);
	assert_int_equal(sim_camera_driver.open(&camera, "hd0", NULL, &diag), 0);
	assert_int_equal(sim_camera_driver.configure(camera, &wanted, &granted, &diag), 0);
	assert_int_equal(granted.format, PIXEL_BAYER_RG8);
	assert_int_equal(granted.period_ns, 4 * sim_scene_period_ns(sim_world_scene()));
	assert_int_equal(sim_camera_driver.start(camera, &diag), 0);
	for (uint64_t i = 0; i < 4; i++) {
		assert_int_equal(sim_camera_driver.acquire(camera, NS_PER_S, &frame), 0);
		first = i ? first : frame.device_seq;
		assert_int_equal(frame.device_seq, first + i);
		int64_t mid_ns =
			sim_world_epoch_ns() + SIM_HD_AFTER_IR_NS +
			sim_scene_mid_exposure_ns(sim_world_scene(), 4 * frame.device_seq + 3);
		assert_int_equal(frame.mid_exposure_ns, mid_ns);
		assert_int_equal(frame.format, PIXEL_BAYER_RG8);
		assert_int_equal(frame.row_time_ns, options.hd_row_ns);
		assert_true(frame.arrival_ns > mid_ns + 540 * options.hd_row_ns);
		sim_camera_driver.release(camera, &frame);
	}
	assert_true(first >= 29); /* 1 s of 30 Hz has passed */
	sim_camera_driver.stop(camera);
	sim_camera_driver.close(camera);
	sim_world_close();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spots_are_where_the_models_project_the_markers),
		cmocka_unit_test(a_head_stands_out_from_a_dark_room),
		cmocka_unit_test(the_same_shot_gives_the_same_picture_whatever_came_before),
		cmocka_unit_test(a_rolling_shutter_exposes_every_row_at_its_time),
		cmocka_unit_test(spots_of_a_rolling_shutter_are_where_the_sights_are),
		cmocka_unit_test(hd_cameras_leave_the_ir_cameras_and_the_truth_as_they_are),
		cmocka_unit_test(more_than_three_hd_cameras_are_refused),
		cmocka_unit_test(live_frames_are_those_of_every_fourth_shot),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
