/*
 * Blobs become points without names: from predictions, from nothing, and not from garbage.
 */
#include "track/match/match.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "tests/bench/points_world.h"

#define NEAR_M 0.002
#define GARBAGE_MAX 4 /* how much more a blob of garbage may cost than a marker's */

static struct world world;
static struct matcher matcher;
static struct tracker_rig rig;

static void begin(uint32_t cameras, uint32_t actors, uint32_t markers, uint64_t seed)
{
	struct world_shape shape = {cameras, actors, markers, {0.075, 0.11, 0.09}, 0.012, 0.2};

	if (actors > 1)
		shape = (struct world_shape){cameras,          actors, markers,
					     {0.2, 0.4, 0.15}, 0.035,  1.5};
	world_init(&world, &shape, seed);
	rig = (struct tracker_rig){.camera_count = cameras,
				   .layout = &world.layout,
				   .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < cameras; c++)
		rig.views[c] = &world.rig.views[c];
}

static void match(const struct shot *shot, const struct seed *seeds, int count)
{
	match_begin(&matcher, &rig, &(struct view_excess){0}, shot);
	match_prepare(&matcher, &rig, seeds, count);
	match_seeds(&matcher);
	match_leftovers(&matcher);
}

static bool has_point(struct vec3 p)
{
	for (uint32_t i = 0; i < matcher.point_count; i++)
		if (vec3_distance(matcher.points[i].fix.p_stage_m, p) < NEAR_M)
			return true;
	return false;
}

/* Of the markers that three cameras see, those that have a point. */
static double found_share(void)
{
	int seen = 0, found = 0;

	for (uint32_t a = 0; a < world.shape.actor_count; a++)
		for (uint32_t m = 0; m < world.layout.marker_count; m++) {
			if (world.seen_by[a][m] < 3)
				continue;
			seen++;
			found += has_point(world.truth_m[a][m]);
		}
	return (double)found / seen;
}

static int false_points(void)
{
	int count = 0;

	for (uint32_t i = 0; i < matcher.point_count; i++) {
		bool is_true = false;

		for (uint32_t a = 0; a < world.shape.actor_count; a++)
			for (uint32_t m = 0; m < world.layout.marker_count; m++)
				is_true |= vec3_distance(matcher.points[i].fix.p_stage_m,
							 world.truth_m[a][m]) < NEAR_M;
		count += !is_true;
	}
	return count;
}

static void points_are_found_from_nothing(void **state)
{
	struct shot shot;

	(void)state;
	for (uint64_t seed = 1; seed < 6; seed++) {
		begin(8, 1, 100, seed);
		world_play(&world, 0, 1000000000, &shot);
		match(&shot, NULL, 0);
		assert_true(found_share() > 0.995);
		assert_true(false_points() <= 1);
		world_finish(&world);
	}
}

static void a_room_of_six_actors_is_found_from_nothing(void **state)
{
	struct shot shot;

	(void)state;
	begin(24, 6, 96, 7);
	world_play(&world, 0, 1000000000, &shot);
	match(&shot, NULL, 0);
	assert_true(found_share() > 0.995);
	assert_true(false_points() <= 3);
	world_finish(&world);
}

static void no_camera_is_needed_more_than_others(void **state)
{
	struct shot shot;

	(void)state;
	begin(8, 1, 60, 8);
	for (uint32_t dead = 0; dead < 8; dead++) {
		world_play(&world, dead, 1000000000, &shot);
		shot.sets[dead] = NULL;
		shot.missing_mask = 1u << dead;
		match(&shot, NULL, 0);
		for (uint32_t i = 0; i < matcher.point_count; i++)
			assert_false(matcher.points[i].claimed_mask >> dead & 1);
		int found =
			(int)(found_share() * 1000); /* some were seen by three with the dead one */
		assert_true(found > 850);
	}
	world_finish(&world);
}

static void wrong_predictions_cost_no_points(void **state)
{
	struct seed seeds[100];
	struct shot shot;
	struct rng rng;

	(void)state;
	begin(8, 1, 100, 9);
	rng_init(&rng, 1, 0);
	world_play(&world, 0, 1000000000, &shot);
	for (int i = 0; i < 100; i++)
		seeds[i] = (struct seed){vec3_add(world.truth_m[0][i], random_in_ball(&rng, 0.02)),
					 0.004, LABEL_NONE, 0};
	match(&shot, seeds, 100);
	assert_true(found_share() > 0.98);
	assert_true(false_points() <= 2);
	world_finish(&world);
}

/* Points that three cameras see and two place plainly, the last one's spots being off. */
static int plain_points(const struct shot *shot, uint32_t outvoted_mask)
{
	struct seed seeds[60];
	int count = 0;

	for (int i = 0; i < 60; i++)
		seeds[i] = (struct seed){world.truth_m[0][i], 0.002, (int16_t)i, outvoted_mask};
	match(shot, seeds, 60);
	for (uint32_t p = 0; p < matcher.point_count; p++)
		count += matcher.points[p].fix.used_mask == 3 &&
			 matcher.points[p].fix.chi2_per_dof < 25;
	return count;
}

static void who_was_outvoted_a_moment_ago_is_again(void **state)
{
	struct shot shot;

	(void)state;
	begin(3, 1, 60, 10);
	world_play(&world, 0, 1000000000, &shot);
	for (uint32_t b = 0; b < world.sets[2].blob_count; b++)
		world.sets[2].blobs[b].x_px += 0.2F;
	int unknown = plain_points(&shot, 0), known = plain_points(&shot, 4);
	print_message("# %d, where it is known %d\n", unknown, known);
	assert_true(known > unknown);
	world_finish(&world);
}

static void every_blob_belongs_to_one_point_at_most(void **state)
{
	static uint8_t taken[CAMERA_MAX][BLOB_MAX];
	struct shot shot;

	(void)state;
	begin(8, 1, 150, 10);
	world_play(&world, 0, 1000000000, &shot);
	match(&shot, NULL, 0);
	memset(taken, 0, sizeof(taken));
	for (uint32_t i = 0; i < matcher.point_count; i++)
		for (uint32_t c = 0; c < 8; c++)
			if (matcher.points[i].claimed_mask >> c & 1)
				assert_int_equal(taken[c][matcher.points[i].blob[c]]++, 0);
	world_finish(&world);
}

static double match_s(const struct shot *shot)
{
	struct timespec before, after;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
	match(shot, NULL, 0);
	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
	return (double)(after.tv_sec - before.tv_sec) +
	       1e-9 * (double)(after.tv_nsec - before.tv_nsec);
}

static void images_full_of_garbage_cost_little_more_a_blob_than_markers(void **state)
{
	struct shot shot;
	struct rng rng;
	uint32_t blobs = 0;

	(void)state;
	begin(24, 6, 96, 11);
	rng_init(&rng, 2, 0);
	world_play(&world, 0, 1000000000, &shot);
	for (uint32_t c = 0; c < 24; c++)
		blobs += world.sets[c].blob_count;
	double honest_s = match_s(&shot) / blobs;

	for (uint32_t c = 0; c < 24; c++)
		while (world.sets[c].blob_count < BLOB_MAX)
			world.sets[c].blobs[world.sets[c].blob_count++] =
				(struct blob){.x_px = (float)(1279 * rng_uniform(&rng)),
					      .y_px = (float)(1023 * rng_uniform(&rng)),
					      .sigma_px = 0.05f};
	double garbage_s = match_s(&shot) / (24 * BLOB_MAX);

	print_message("# %.2f us a marker's blob, %.2f us a blob of garbage\n", 1e6 * honest_s,
		      1e6 * garbage_s);
	assert_true(garbage_s < GARBAGE_MAX * honest_s);
	world_finish(&world);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(points_are_found_from_nothing),
		cmocka_unit_test(a_room_of_six_actors_is_found_from_nothing),
		cmocka_unit_test(no_camera_is_needed_more_than_others),
		cmocka_unit_test(wrong_predictions_cost_no_points),
		cmocka_unit_test(who_was_outvoted_a_moment_ago_is_again),
		cmocka_unit_test(every_blob_belongs_to_one_point_at_most),
		cmocka_unit_test(images_full_of_garbage_cost_little_more_a_blob_than_markers),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
