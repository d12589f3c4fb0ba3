/*
 * Who is to be seen in HD pictures: faces that live, and everybody of them.
 */
#include "sim/render/hd_figures.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#include "sim/world/scene_parts.h"

/* Mean of what the paint shows along a stretch of the face. */
static double look(const struct hd_paint *paint, struct hd_mood mood, float x, float y)
{
	double sum = 0;

	for (int i = -4; i <= 4; i++) {
		float at = x + 0.01f * (float)i;
		const uint8_t *texel = paint->face[hd_texel_index(y, HD_PAINT_SIDE)]
						  [hd_texel_index(at, HD_PAINT_SIDE)];

		if (texel[HD_COLOURS] != HD_STILL)
			texel = hd_paint_live(paint, &mood, texel, at, y);
		sum += texel[HD_GREEN] / 9.0;
	}
	return sum;
}

static void parted_lips_show_teeth_and_closed_lids_hide_eyes(void **state)
{
	static struct hd_paint paint;
	const struct hd_mood calm = {0}, open = {.gap = 0.2f}, asleep = {.lids = {1, 1}};

	(void)state;
	hd_paint_init(&paint, 3);
	assert_true(look(&paint, open, 0, -0.67f) > look(&paint, calm, 0, -0.67f) + 30);
	assert_true(look(&paint, open, 0, -0.76f) < look(&paint, calm, 0, -0.76f) - 10);
	for (float x = -0.38f; x < 0.5f; x += 0.76f)
		assert_true(look(&paint, asleep, x, 0.045f) > look(&paint, calm, x, 0.045f) + 5);
	assert_true(look(&paint, asleep, 0, 0.3f) == look(&paint, calm, 0, 0.3f));
}

static void skin_has_texture_at_several_scales_and_heads_differ(void **state)
{
	static struct hd_paint a, b;
	double fine = 0, coarse = 0;
	int count = 0, same = 0;

	(void)state;
	hd_paint_init(&a, 1);
	hd_paint_init(&b, 2);
	for (int y = 150; y < 180; y++) /* of a cheek */
		for (int x = 250; x < 290; x++, count++) {
			double here = a.face[y][x][HD_GREEN];

			fine += fabs(here - a.face[y][x + 1][HD_GREEN]);
			coarse += fabs(here - a.face[y][x + 40][HD_GREEN]);
			same += memcmp(a.face[y][x], b.face[y][x], HD_COLOURS) == 0;
		}
	assert_true(fine / count > 0.3 && coarse / count > 1.5 * fine / count);
	assert_true(same * 10 < count);
}

/* The middle of every head that faces the camera is skin, wherever its actor stands. */
static void every_actor_is_drawn(void **state)
{
	const struct sim_options options = {.scene = "four-actors",
					    .seed = 1,
					    .hd_camera_count = 3,
					    .hd_after_ir_ns = SIM_HD_AFTER_IR_NS};
	static struct sim_rolling rolling;
	static uint8_t image[1920 * 1080];
	static int8_t grain[HD_GRAIN + HD_GRAIN_MORE];
	struct hd_canvas canvas = {image, 1920, grain, 0};
	struct pixel_window covered[HD_FIGURE_MAX];
	struct hd_figures *figures;
	struct sim_scene *scene;
	uint32_t heads = 0;

	(void)state;
	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	assert_int_equal(hd_figures_create(&figures, scene), 0);
	for (uint32_t c = scene->camera_count; c < scene->camera_count + 3; c++) {
		memset(image, 0, sizeof(image));
		sim_rolling_init(&rolling, scene, c, 400);
		hd_figures_draw(figures, &rolling, &scene->cameras[c], &canvas, covered);
		for (uint32_t a = 0; a < scene->actor_count; a++) {
			struct vec3 head = rolling.at[1].actors[a].rt_stage_head.t;
			double pixel[2];

			if (vec3_distance(head, scene->cameras[c].centre_stage_m) > 1.8 ||
			    !sim_camera_project(&scene->cameras[c], head, pixel))
				continue;
			if (pixel[0] < 0 || pixel[1] < 0 || pixel[0] > 1919 || pixel[1] > 1079)
				continue;
			assert_true(image[(int)pixel[1] * 1920 + (int)pixel[0]] > 8);
			heads++;
		}
	}
	assert_true(heads >= 3);
	hd_figures_destroy(figures);
	sim_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(parted_lips_show_teeth_and_closed_lids_hide_eyes),
		cmocka_unit_test(skin_has_texture_at_several_scales_and_heads_differ),
		cmocka_unit_test(every_actor_is_drawn),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
