/*
 * Who takes which blob: the marker in front, halves of spots that are two markers'.
 */
#include "track/match/match.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tests/bench/points_world.h"
#include "track/match/match_parts.h"

#define NEAR_M 0.002
#define APART_M 0.0005

static struct world world;
static struct matcher matcher;
static struct tracker_rig rig;
static struct shot shot;

static void begin(uint32_t cameras)
{
	struct world_shape shape = {cameras, 1, 10, {0.075, 0.11, 0.09}, 0.012, 0.2};

	world_init(&world, &shape, 3);
	rig = (struct tracker_rig){.camera_count = cameras,
				   .layout = &world.layout,
				   .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < cameras; c++)
		rig.views[c] = &world.rig.views[c];
	world_play(&world, 0, 1000000000, &shot);
	for (uint32_t c = 0; c < cameras; c++)
		world.sets[c].blob_count = 0;
}

static void match(const struct seed *seeds, int count)
{
	match_begin(&matcher, &rig, &(struct view_excess){0}, &shot);
	match_prepare(&matcher, &rig, seeds, count);
	match_seeds(&matcher);
}

/* What camera c shows of p, that far aside. */
static void show(uint32_t c, struct vec3 p, double aside_px, double sigma_px, int flags)
{
	struct blob_set *set = &world.sets[c];
	double pixel[2];

	assert_true(view_project(&world.rig.views[c], p, pixel, NULL));
	set->blobs[set->blob_count++] = (struct blob){.x_px = (float)(pixel[0] + aside_px),
						      .y_px = (float)pixel[1],
						      .sigma_px = (float)sigma_px,
						      .shape_px2 = {0.2F, 0, 0.2F},
						      .flags = (uint16_t)flags};
}

/* Two markers, seen by cameras 0, 1, 2 and by 1, 2, 3. The second is hidden from camera 0 right
 * behind the first, whose spot there is that far aside and in camera 2 one with another's. */
static void match_one_behind(double aside_px, struct vec3 *front)
{
	struct seed seeds[2] = {{.radius_m = 0.001, .label = 0}, {.radius_m = 0.001, .label = 1}};

	begin(4);
	struct vec3 eye = world.rig.views[0].centre_stage_m, middle = {0, 0, 0};
	for (int m = 0; m < 10; m++)
		middle = vec3_add(middle, vec3_scale(world.truth_m[0][m], 0.1));
	struct vec3 behind = vec3_add(middle, vec3_scale(vec3_sub(middle, eye), 0.02));

	seeds[0].p_stage_m = middle;
	seeds[1].p_stage_m = behind;
	for (uint32_t c = 1; c < 4; c++)
		show(c, behind, 0, 0.02, 0);
	show(0, middle, aside_px, 0.02, 0);
	show(1, middle, 0, 0.02, 0);
	show(2, middle, 0.4, 1.5, BLOB_MERGED);
	match(seeds, 2);
	*front = middle;
}

static void the_spot_in_front_is_not_lost_to_the_marker_behind(void **state)
{
	struct vec3 front;

	(void)state;
	match_one_behind(0.4, &front);
	assert_int_equal(matcher.point_count, 2);
	for (uint32_t p = 0; p < 2; p++)
		assert_int_equal(matcher.points[p].claimed_mask & 1,
				 vec3_distance(matcher.points[p].fix.p_stage_m, front) < NEAR_M);
	world_finish(&world);
}

static void a_spot_that_is_not_beside_stays_with_who_is_sure(void **state)
{
	struct vec3 front;

	(void)state;
	match_one_behind(0.25, &front);
	assert_int_equal(matcher.point_count, 1);
	assert_int_equal(matcher.points[0].claimed_mask, 0xf);
	world_finish(&world);
}

/* A point of five halves, one in each camera, whose other halves are of those markers; of marker -1
 * no point has the other half. */
static int sure_views_of_halves(const int16_t others[5])
{
	struct point point = {.fix = {.used_mask = 0x1f, .used_count = 5}};

	for (int c = 0; c < 5; c++) {
		matcher.cameras[c].blobs = matcher.parted[c];
		matcher.other_half[c][0] = 1;
		matcher.other_half[c][1] = 0;
		matcher.part_label[c][0] = 3;
		matcher.part_label[c][1] = others[c];
		matcher.cameras[c].owner[1] = others[c];
	}
	return match_sure_views(&matcher, &point);
}

static void halves_of_other_pairs_take_away(void **state)
{
	(void)state;
	assert_int_equal(sure_views_of_halves((int16_t[]){7, 7, 7, 7, 7}), 5);
	assert_int_equal(sure_views_of_halves((int16_t[]){7, 7, 7, -1, -1}), 3);
	assert_int_equal(sure_views_of_halves((int16_t[]){7, 7, 7, 7, 2}), 3);
	assert_int_equal(sure_views_of_halves((int16_t[]){7, 7, 7, 2, -1}), 2);
}

/* A spot that two cameras see is two pressed lips: the first halves are label 5's point, the others
 * are label 6's. Returns the point. */
static int show_pressed(void)
{
	struct point one = {.fix = {.used_mask = 3, .used_count = 2}, .claimed_mask = 3};

	begin(2);
	one.fix.p_stage_m = world.truth_m[0][0];
	for (uint32_t c = 0; c < 2; c++) {
		show(c, one.fix.p_stage_m, 0, 0.05, BLOB_MERGED);
		show(c, vec3_add(one.fix.p_stage_m, (struct vec3){APART_M, 0, 0}), 0, 0.05,
		     BLOB_MERGED);
	}
	match(NULL, 0);
	for (uint32_t c = 0; c < 2; c++) {
		memcpy(matcher.parted[c], world.sets[c].blobs, 2 * sizeof(struct blob));
		matcher.cameras[c].blobs = matcher.parted[c];
		for (int16_t b = 0; b < 2; b++) {
			matcher.other_half[c][b] = (int16_t)(1 - b);
			matcher.part_label[c][b] = (int16_t)(5 + b);
			matcher.half_kind[c][b] = HALF_PLAIN;
		}
	}
	claim(&matcher, &one);
	return (int)matcher.point_count - 1;
}

static void of_pressed_lips_the_other_halves_are_the_other(void **state)
{
	(void)state;
	int one = show_pressed();

	assert_int_equal(match_across(&matcher, &matcher.points[one]), 6);
	int other = match_other_halves(&matcher, one);
	assert_int_equal(other, one + 1);
	assert_true(matcher.points[other].is_pressed);
	double apart_m = vec3_distance(matcher.points[other].fix.p_stage_m, world.truth_m[0][0]);
	assert_true(fabs(apart_m - APART_M) < 0.0001);
	assert_int_equal(match_other_halves(&matcher, one), -1); /* they are taken */
	match_give_back(&matcher);
	for (int c = 0; c < 2; c++)
		assert_int_equal(matcher.cameras[c].owner[1], -1);
	assert_int_equal(match_other_halves(&matcher, one), other);
	world_finish(&world);
}

static void other_halves_of_two_labels_are_nobodys(void **state)
{
	(void)state;
	int one = show_pressed();

	matcher.part_label[1][1] = 7;
	assert_int_equal(match_other_halves(&matcher, one), -1);
	world_finish(&world);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_spot_in_front_is_not_lost_to_the_marker_behind),
		cmocka_unit_test(a_spot_that_is_not_beside_stays_with_who_is_sure),
		cmocka_unit_test(halves_of_other_pairs_take_away),
		cmocka_unit_test(of_pressed_lips_the_other_halves_are_the_other),
		cmocka_unit_test(other_halves_of_two_labels_are_nobodys),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
