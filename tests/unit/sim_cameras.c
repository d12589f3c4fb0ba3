/*
 * Lenses and placements: what is written is what the scene projects with and what a station loads;
 * a room's cameras see markers as large as they must.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "config/rig.h"
#include "sim/cameras.h"

static char dir[] = "/tmp/stage-lens-XXXXXX";
static char names[SIM_CAMERA_MAX][NAME_BYTES];
static struct sim_camera cameras[SIM_CAMERA_MAX];

static const struct sim_script ROOM = {
	.placement = SIM_PLACEMENT_ROOM,
	.lens = SIM_LENS_SPLINED,
	.actor_count = 6,
	.actors = {{.seat_m = {-0.8, -0.4, 1.2}},
		   {.seat_m = {0, -0.4, 1.6}},
		   {.seat_m = {0.8, -0.4, 1.2}},
		   {.seat_m = {-0.8, 0.6, 1.6}, .facing_deg = 180},
		   {.seat_m = {0, 0.6, 1.2}, .facing_deg = 90},
		   {.seat_m = {0.8, 0.6, 1.6}, .facing_deg = -90}},
};

static const char *model_path(uint32_t camera)
{
	static char path[sizeof(dir) + NAME_BYTES + 32];

	snprintf(path, sizeof(path), "%s/%.63s.cameramodel", dir, cameras[camera].name);
	return path;
}

static void write_rig(uint32_t count)
{
	for (uint32_t c = 0; c < count; c++) {
		memcpy(names[c], cameras[c].name, NAME_BYTES);
		assert_int_equal(sim_camera_write(&cameras[c], model_path(c), NULL), 0);
	}
}

static void remove_rig(uint32_t count)
{
	for (uint32_t c = 0; c < count; c++)
		unlink(model_path(c));
	rmdir(dir);
}

/* A point of the stage that falls on that pixel, by going along the camera's ray. */
static struct vec3 point_at(const struct view *view, const double pixel[2], double range_m)
{
	return vec3_add(view->centre_stage_m, vec3_scale(view_ray(view, pixel), range_m));
}

/* The worst distance between where the scene has a point and where the station looks for it. */
static double worst_error_px(const struct view *view, const struct sim_camera *camera,
			     struct rng *rng)
{
	double worst = 0;

	for (int i = 0; i < 2000; i++) {
		double asked[2] = {rng_uniform(rng) * (camera->width_px - 1),
				   rng_uniform(rng) * (camera->height_px - 1)};
		struct vec3 p = point_at(view, asked, 1 + 4 * rng_uniform(rng));
		double truth[2], found[2];

		assert_true(sim_camera_project(camera, p, truth));
		assert_true(view_project(view, p, found, NULL));
		worst = fmax(worst, hypot(truth[0] - asked[0], truth[1] - asked[1]));
		worst = fmax(worst, hypot(truth[0] - found[0], truth[1] - found[1]));
	}
	return worst;
}

static void check_station_sees_as_the_scene(uint32_t count)
{
	struct diag diag = {0};
	struct rig rig;
	struct rng rng;
	double worst_px = 0;

	rng_init(&rng, 1, 1);
	strcpy(dir + strlen(dir) - 6, "XXXXXX");
	assert_non_null(mkdtemp(dir));
	write_rig(count);
	assert_int_equal(rig_load(&rig, dir, names, count, &diag), 0);
	for (uint32_t c = 0; c < count; c++)
		worst_px = fmax(worst_px, worst_error_px(&rig.views[c], &cameras[c], &rng));
	assert_true(worst_px < 1e-3);
	rig_finish(&rig);
	remove_rig(count);
}

static void station_looks_through_the_same_lenses_as_the_scene(void **state)
{
	struct sim_script face = {.placement = SIM_PLACEMENT_FACE};

	(void)state;
	for (int lens = SIM_LENS_OPENCV8; lens <= SIM_LENS_SPLINED; lens++) {
		face.lens = lens;
		sim_cameras_init(cameras, 3, &face, 11);
		check_station_sees_as_the_scene(3);
		sim_hd_cameras_init(cameras, 3, &face, 11);
		check_station_sees_as_the_scene(3);
	}
	sim_cameras_init(cameras, 24, &ROOM, 11);
	check_station_sees_as_the_scene(4);
}

/* What does not change sign with the direction: of OPENCV8 the decentring alone, a fraction of a
 * pixel. */
static double even_part_px(const struct sim_camera *camera)
{
	struct pose rt_stage_cam = pose_inverse(&camera->rt_cam_stage);
	double worst = 0;

	for (double x = -0.25; x <= 0.25; x += 0.02)
		for (double y = -0.2; y <= 0.2; y += 0.02) {
			struct vec3 one = {x, y, 1}, other = {-x, -y, 1};
			double p[2], q[2];

			assert_true(sim_camera_project(camera, pose_apply(&rt_stage_cam, one), p));
			assert_true(
				sim_camera_project(camera, pose_apply(&rt_stage_cam, other), q));
			worst = fmax(worst, hypot(p[0] + q[0] - 2 * camera->intrinsics[2],
						  p[1] + q[1] - 2 * camera->intrinsics[3]));
		}
	return worst;
}

static void splined_lens_bends_as_opencv8_cannot(void **state)
{
	struct sim_script face = {.placement = SIM_PLACEMENT_FACE};

	(void)state;
	for (uint64_t seed = 0; seed < 5; seed++) {
		face.lens = SIM_LENS_OPENCV8;
		sim_cameras_init(cameras, 2, &face, seed);
		assert_true(even_part_px(&cameras[0]) < 0.7);
		face.lens = SIM_LENS_SPLINED;
		sim_cameras_init(cameras, 2, &face, seed);
		assert_true(even_part_px(&cameras[0]) > 1);
	}
}

static double marker_px(const struct sim_camera *camera, struct vec3 p, double diameter_m)
{
	return camera->focal_px * diameter_m / vec3_distance(camera->centre_stage_m, p);
}

static bool in_image(const struct sim_camera *camera, struct vec3 p)
{
	double q[2];

	return sim_camera_project(camera, p, q) && q[0] >= 0 && q[1] >= 0 &&
	       q[0] < camera->width_px && q[1] < camera->height_px;
}

static void room_cameras_stand_on_walls_and_see_markers_large_enough(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 5; seed++) {
		int large = 0, pairs = 0;

		sim_cameras_init(cameras, 24, &ROOM, seed);
		for (uint32_t c = 0; c < 24; c++)
			assert_true(fabs(fabs(cameras[c].centre_stage_m.x) - 3.5) < 1e-9 ||
				    fabs(fabs(cameras[c].centre_stage_m.y - 0.1) - 3.2) < 1e-9);
		for (uint32_t a = 0; a < ROOM.actor_count; a++) {
			int seeing = 0;

			for (uint32_t c = 0; c < 24; c++) {
				if (!in_image(&cameras[c], ROOM.actors[a].seat_m))
					continue;
				seeing++;
				pairs++;
				large += marker_px(&cameras[c], ROOM.actors[a].seat_m, 3.2e-3) >=
					 2.5;
			}
			assert_true(seeing >= 16);
		}
		assert_true(large > pairs / 2);
	}
}

static void room_cameras_look_into_each_other(void **state)
{
	int pairs = 0;

	(void)state;
	sim_cameras_init(cameras, 24, &ROOM, 3);
	for (uint32_t c = 0; c < 24; c++)
		for (uint32_t other = 0; other < 24; other++)
			pairs += c != other && in_image(&cameras[c], cameras[other].centre_stage_m);
	assert_true(pairs > 24);
}

static void defocus_grows_away_from_the_focused_range(void **state)
{
	(void)state;
	sim_cameras_init(cameras, 24, &ROOM, 3);
	const struct sim_camera *camera = &cameras[0];

	assert_true(sim_camera_defocus_px(camera, camera->range_m) < 1e-9);
	for (double step_m = 0.2; step_m < 1.5; step_m += 0.2) {
		double near = sim_camera_defocus_px(camera, camera->range_m - step_m);

		assert_true(near > sim_camera_defocus_px(camera, camera->range_m - step_m + 0.1));
		assert_true(near > sim_camera_defocus_px(camera, camera->range_m + step_m));
		assert_true(near < 4);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(station_looks_through_the_same_lenses_as_the_scene),
		cmocka_unit_test(splined_lens_bends_as_opencv8_cannot),
		cmocka_unit_test(room_cameras_stand_on_walls_and_see_markers_large_enough),
		cmocka_unit_test(room_cameras_look_into_each_other),
		cmocka_unit_test(defocus_grows_away_from_the_focused_range),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
