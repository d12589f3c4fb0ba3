/*
 * What shines beside markers: other cameras' lamps, glints on teeth and eyes; and what is left of a
 * picture when the strobe is dead.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sim/render/lamps.h"
#include "sim/render/render.h"
#include "sim/world/scene_parts.h"

static const char *const kinds[] = {"gaussian", "tailed"};

static struct sim_scene *make(const char *name, int kind, uint32_t hd_count)
{
	const struct sim_options options = {
		.scene = name, .seed = 4, .optics = kinds[kind], .hd_camera_count = hd_count};
	struct sim_scene *scene;

	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	return scene;
}

static bool is_inside(const struct sim_camera *camera, const double q[2])
{
	return q[0] > 1 && q[1] > 1 && q[0] < camera->width_px - 2 && q[1] < camera->height_px - 2;
}

static uint8_t pixel_at(const uint8_t *image, int width_px, const double q[2])
{
	return image[(long)lround(q[1]) * width_px + lround(q[0])];
}

/* How many of the lamps saturate the picture; all of them must. */
static int check_picture(struct sim_scene *scene, uint32_t c, const struct spot *lamps,
			 uint32_t count)
{
	struct sim_renderer *renderer;
	int width_px, height_px, inside = 0;

	assert_int_equal(sim_renderer_create(&renderer, scene, c, SIM_NOISE_FULL), 0);
	const uint8_t *image = sim_render(renderer, 0, &width_px, &height_px);

	for (uint32_t i = 0; i < count; i++) {
		if (!is_inside(&scene->cameras[c], lamps[i].centre_px))
			continue;
		assert_int_equal(pixel_at(image, width_px, lamps[i].centre_px), 255);
		inside++;
	}
	sim_renderer_destroy(renderer);
	return inside;
}

static void strobes_of_other_cameras_saturate_unless_somebody_stands_between(void **state)
{
	static struct sim_truth truth;

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct sim_scene *scene = make("four-actors", kind, 0);
		uint32_t shining = 0, unobstructed = 0;
		struct spot lamps[LAMP_MAX];
		int saturated = 0;

		scene->script.cross_strobes = true;
		sim_scene_truth(scene, 1e-9 * (double)sim_scene_mid_exposure_ns(scene, 0), &truth);
		for (uint32_t c = 0; c < scene->camera_count; c++) {
			uint32_t count = lamps_find(scene, &truth, c, true, lamps);

			shining += count;
			if (c < 3)
				saturated += check_picture(scene, c, lamps, count);
		}
		truth.occluder_count = 0;
		for (uint32_t c = 0; c < scene->camera_count; c++)
			unobstructed += lamps_find(scene, &truth, c, true, lamps);
		assert_true(saturated > 2);
		assert_true(unobstructed > shining);
		sim_scene_destroy(scene);
	}
}

static void ring_lights_are_dots_that_do_not_saturate(void **state)
{
	static struct sim_truth truth;
	struct sim_scene *scene = make("11-body-and-face", 0, 3);
	struct spot spots[LAMP_MAX];
	uint32_t seen = 0;

	(void)state;
	scene->script.ring_lights = true;
	sim_scene_truth(scene, 0, &truth);
	for (uint32_t c = 0; c < scene->camera_count; c++) {
		uint32_t count = lamps_find(scene, &truth, c, true, spots);

		for (uint32_t i = 0; i < count; i++)
			assert_true(spots[i].brightness < 245);
		seen += count;
	}
	scene->script.ring_lights = false;
	for (uint32_t c = 0; c < scene->camera_count; c++)
		assert_int_equal(lamps_find(scene, &truth, c, true, spots), 0);
	assert_true(seen >= LAMP_RING_LEDS);
	sim_scene_destroy(scene);
}

static void glints_are_in_the_picture_where_the_truth_has_them(void **state)
{
	static struct sim_truth truth;
	int seen = 0, bright = 0, width_px, height_px;

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct sim_scene *scene = make("03-ghosts", kind, 0);
		struct sim_renderer *renderer;

		assert_int_equal(sim_renderer_create(&renderer, scene, 1, SIM_NOISE_FAST), 0);
		for (uint64_t shot = 0; shot < 600; shot += 20) {
			const uint8_t *image = sim_render(renderer, shot, &width_px, &height_px);

			sim_scene_truth(scene,
					1e-9 * (double)sim_scene_mid_exposure_ns(scene, shot),
					&truth);
			for (uint32_t g = 0; g < truth.ghost_count; g++) {
				double q[2], value;
				struct vec3 p;

				if (!scene_camera_sees_ghost(scene, &truth, 1, g, &p, q, &value) ||
				    value < 0.5)
					continue;
				seen++;
				bright += pixel_at(image, width_px, q) > 40;
			}
		}
		sim_renderer_destroy(renderer);
		sim_scene_destroy(scene);
	}
	assert_true(seen > 20);
	assert_int_equal(bright, seen);
}

static long sum_of(const uint8_t *image, int count)
{
	long sum = 0;

	for (int i = 0; i < count; i++)
		sum += image[i] > 60;
	return sum;
}

static void dead_strobe_takes_the_markers_and_leaves_the_noise(void **state)
{
	int width_px, height_px;

	(void)state;
	for (int kind = 0; kind < 2; kind++) {
		struct sim_scene *scene = make("talking", kind, 0);
		struct sim_renderer *renderer;
		double sum = 0;

		assert_int_equal(sim_renderer_create(&renderer, scene, 1, SIM_NOISE_FAST), 0);
		const uint8_t *image = sim_render(renderer, 3, &width_px, &height_px);

		assert_true(sum_of(image, width_px * height_px) > 200);
		image = sim_render_unlit(renderer, 3, &width_px, &height_px);
		assert_true(sum_of(image, width_px * height_px) < 10); /* hot pixels */
		for (int i = 0; i < width_px * height_px; i++)
			sum += image[i];
		assert_true(sum / (width_px * height_px) > 7);
		sim_renderer_destroy(renderer);
		sim_scene_destroy(scene);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(strobes_of_other_cameras_saturate_unless_somebody_stands_between),
		cmocka_unit_test(ring_lights_are_dots_that_do_not_saturate),
		cmocka_unit_test(glints_are_in_the_picture_where_the_truth_has_them),
		cmocka_unit_test(dead_strobe_takes_the_markers_and_leaves_the_noise),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
