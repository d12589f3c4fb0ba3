/*
 * What the calibration of an actor learns, against the truth of the simulator.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "calib/actor/actor_file.h"
#include "calib/actor/actor_learn.h"
#include "calib/actor/actor_points.h"
#include "calib/actor/actor_pose.h"
#include "calib/actor/actor_script.h"
#include "calib/actor/actor_take.h"
#include "config/layout_file.h"
#include "sim/face/face_basis.h"
#include "sim/play.h"

#define MM 1e-3
#define RATE_HZ 60.0
#define REST_SHOTS 150

static struct sim_play play;
static struct layout layout;

static void begin(const char *scene, uint64_t seed, double rate_hz)
{
	struct sim_options options = {.scene = scene, .seed = seed, .rate_hz = rate_hz};
	struct diag diag = {0};
	int err = sim_play_init(&play, &options, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
	actor_layout(sim_scene_layout(play.scene), 0, &layout);
}

static void take_shot(uint64_t n, struct actor_shot *shot)
{
	static const struct blob_play as_optics = {0};

	sim_play_shot_us(&play, &as_optics, n, 0);
	shot->mid_exposure_ns = play.set.mid_exposure_ns;
	shot->head_found = play.set.heads[0].valid;
	shot->count = layout.marker_count;
	for (uint32_t i = 0; i < shot->count; i++) {
		const struct marker *m = &play.set.markers[i];

		shot->seen[i] = m->status == MARKER_MEASURED && m->flags & MARKER_STABILISED;
		shot->p_m[i] =
			(struct vec3){m->stabilised_m[0], m->stabilised_m[1], m->stabilised_m[2]};
	}
}

static void the_script_is_the_simulators(void **state)
{
	(void)state;
	assert_int_equal(ACTOR_POSE_COUNT, FACE_POSE_COUNT);
	for (int k = 0; k < ACTOR_POSE_COUNT; k++) {
		assert_string_equal(ACTOR_PROMPTS[k].name, FACE_POSES[k].name);
		assert_true(ACTOR_PROMPTS[k].text[0]);
		assert_int_equal(actor_prompt_find(ACTOR_PROMPTS[k].name), k);
		assert_int_equal(strncmp(ACTOR_PROMPTS[k].name, "phoneme_", 8) == 0,
				 k >= ACTOR_POSE_COUNT - ACTOR_PHONEME_COUNT);
	}
}

/* One take of the neutral and of the first poses, kept for several tests. */
struct performed {
	struct actor_part neutral;
	struct actor_part poses[ACTOR_POSE_COUNT];
	struct vec3 true_min_m[LABEL_MAX], true_max_m[LABEL_MAX];
	int held;
};

static struct performed performed;

static void note_truth(struct performed *p)
{
	struct pose back = pose_inverse(&play.truth.actors[0].rt_stage_head);

	for (uint32_t i = 0; i < layout.marker_count; i++) {
		struct vec3 at = pose_apply(&back, play.truth.markers[i].p_stage_m);
		struct vec3 d = vec3_sub(at, layout.markers[i].neutral_m);

		if (__builtin_popcount(play.truth.markers[i].visible_mask) < 3)
			continue; /* what nobody saw cannot be learned */
		p->true_min_m[i] =
			(struct vec3){fmin(p->true_min_m[i].x, d.x), fmin(p->true_min_m[i].y, d.y),
				      fmin(p->true_min_m[i].z, d.z)};
		p->true_max_m[i] =
			(struct vec3){fmax(p->true_max_m[i].x, d.x), fmax(p->true_max_m[i].y, d.y),
				      fmax(p->true_max_m[i].z, d.z)};
	}
}

static void use_neutral(struct actor_pose *pose, const struct actor_neutral *neutral)
{
	pose->count = layout.marker_count;
	for (uint32_t i = 0; i < pose->count; i++) {
		pose->on_face[i] = !layout.markers[i].rigid && neutral->shots[i];
		pose->neutral_m[i] = neutral->mean_m[i];
	}
}

static void every_pose_is_seen_once_and_in_its_time(void **state)
{
	static struct actor_neutral neutral;
	static struct actor_shot shot;
	static struct actor_pose pose;
	uint64_t n = 0;
	int index = 0;

	(void)state;
	begin("range-of-motion", 11, RATE_HZ);
	for (; n < REST_SHOTS; n++) {
		take_shot(n, &shot);
		assert_int_equal(actor_part_add(&performed.neutral, &shot), 0);
	}
	assert_int_equal(actor_neutral_learn(&performed.neutral, &neutral), 0);
	use_neutral(&pose, &neutral);
	actor_pose_next(&pose);
	for (; index < ACTOR_POSE_COUNT && n < 140 * 60; n++) {
		take_shot(n, &shot);
		note_truth(&performed);
		actor_part_add(&performed.poses[index], &shot);
		if (actor_pose_step(&pose, &shot) != POSE_RETURNED)
			continue;
		performed.held += pose.was_held;
		/* pose k of the scene lasts from 3 + 2 k to 3 + 2 k + 2 s */
		double at_s = (double)n / RATE_HZ - 3 - 2 * index;
		if (at_s < 1.0 || at_s > 2.2)
			print_message("# %s at %.2f s\n", ACTOR_PROMPTS[index].name, at_s);
		assert_true(at_s > 1.0 && at_s < 2.2);
		actor_pose_next(&pose);
		index++;
	}
	assert_int_equal(index, ACTOR_POSE_COUNT);
	print_message("# %d of %d held\n", performed.held, index);
	assert_true(performed.held > 55);
	sim_play_finish(&play);
}

static bool contains(const struct layout_learned *l, struct vec3 min_m, struct vec3 max_m,
		     double slack_m)
{
	return l->range_min_m.x < min_m.x + slack_m && l->range_min_m.y < min_m.y + slack_m &&
	       l->range_min_m.z < min_m.z + slack_m && l->range_max_m.x > max_m.x - slack_m &&
	       l->range_max_m.y > max_m.y - slack_m && l->range_max_m.z > max_m.z - slack_m;
}

static void neutral_and_ranges_are_the_truths(void **state)
{
	static struct actor_neutral neutral;
	struct layout wanted = layout;
	uint32_t known = 0, contained = 0;

	(void)state;
	assert_int_equal(actor_neutral_learn(&performed.neutral, &neutral), 0);
	actor_learn(&layout, &neutral, performed.poses, ACTOR_POSE_COUNT);
	for (uint32_t i = 0; i < layout.marker_count; i++) {
		const struct layout_marker *m = &layout.markers[i];

		assert_true(vec3_distance(m->neutral_m, wanted.markers[i].neutral_m) < 0.05 * MM);
		if (m->rigid) {
			assert_false(m->learned.known);
			continue;
		}
		known += m->learned.known;
		bool in = contains(&m->learned, performed.true_min_m[i], performed.true_max_m[i],
				   0.3 * MM);
		contained += in;
		if (!in)
			print_message("# range of %s falls short\n", m->name);
		assert_true(m->learned.rest_sd_m < 0.1 * MM);
		assert_true(m->learned.neighbour_count > 0);
	}
	assert_int_equal(known, 70);
	assert_true(contained >= 66);
}

static void neighbours_move_together_and_are_not_across_the_lips(void **state)
{
	(void)state;
	for (uint32_t i = 0; i < layout.marker_count; i++) {
		const struct layout_marker *m = &layout.markers[i];

		for (int k = 0; k < m->learned.neighbour_count; k++) {
			const struct layout_neighbour *other = &m->learned.neighbours[k];
			const char *group = layout.markers[other->marker].group;

			assert_false(strcmp(m->group, "lip_upper") == 0 &&
				     strcmp(group, "lip_lower") == 0);
			assert_true(k == 0 ||
				    other->spread_m >= m->learned.neighbours[k - 1].spread_m);
		}
	}
}

static void expect_point(const char *name, const char *point)
{
	for (uint32_t i = 0; i < layout.marker_count; i++)
		if (strcmp(layout.markers[i].name, name) == 0)
			assert_string_equal(layout.markers[i].mpeg4, point);
}

static void an_actors_file_is_read_as_it_was_written(void **state)
{
	static struct layout read;
	char path[] = "/tmp/calib_actorXXXXXX";
	FILE *file = fdopen(mkstemp(path), "w");
	struct diag diag = {0};

	(void)state;
	assert_non_null(file);
	assert_int_equal(actor_points_name(&layout), 31);
	actor_file_write(file, &layout, "2026-11-22T12:00:00Z");
	fclose(file);
	int err = layout_load(&read, path, &diag);
	unlink(path);
	diag_print(&diag, stderr);
	assert_int_equal(err, 0);
	assert_int_equal(read.marker_count, layout.marker_count);
	assert_string_equal(read.actors[0].name, layout.actors[0].name);
	expect_point("lip_u_1", "8.1");
	expect_point("lip_c_l_1", "8.3");
	expect_point("brow_r_4", "4.6");
	expect_point("nose_4", "9.3");
	for (uint32_t i = 0; i < layout.marker_count; i++) {
		const struct layout_marker *a = &layout.markers[i], *b = &read.markers[i];

		assert_string_equal(a->name, b->name);
		assert_string_equal(a->mpeg4, b->mpeg4);
		assert_true(vec3_distance(a->neutral_m, b->neutral_m) < 1e-6);
		assert_int_equal(a->learned.known, b->learned.known);
		assert_int_equal(a->learned.neighbour_count, b->learned.neighbour_count);
		assert_true(vec3_distance(a->learned.range_max_m, b->learned.range_max_m) < 1e-6);
		for (int k = 0; k < a->learned.neighbour_count; k++)
			assert_int_equal(a->learned.neighbours[k].marker,
					 b->learned.neighbours[k].marker);
	}
}

static struct actor_take take;

static void play_take(const char *scene, uint64_t seed, double seconds)
{
	static struct actor_shot shot;

	begin(scene, seed, RATE_HZ);
	actor_take_begin(&take, &layout);
	for (uint64_t n = 0; n < seconds * RATE_HZ; n++) {
		take_shot(n, &shot);
		actor_take_step(&take, &shot);
	}
	actor_take_end(&take);
	sim_play_finish(&play);
}

static void a_takes_first_neutral_is_found(void **state)
{
	(void)state;
	play_take("05-fallen-and-reapplied", 3, 8);
	assert_true(take.start.found);
	assert_true(take.start.begin_ns - take.first_ns < 500000000);
	/* the markers were put on anew by a millimetre or so, and that is no expression */
	assert_true(take.start.fit.residual_m > 0.5 * MM);
	assert_true(take.start.fit.shared_m < 1.5 * MM);
	assert_false(take.end.found);
}

static void a_rest_is_neutral_at_both_ends(void **state)
{
	(void)state;
	play_take("rest", 4, 2);
	assert_true(take.start.found && take.end.found);
	assert_true(take.start.fit.residual_m < 0.1 * MM);
}

static void a_take_without_neutral_has_none(void **state)
{
	(void)state;
	for (uint64_t seed = 5; seed < 8; seed++) {
		play_take("10-no-neutral", seed, 12);
		assert_false(take.start.found || take.end.found);
	}
}

static void a_held_expression_is_no_neutral(void **state)
{
	static struct actor_rest rest;
	struct actor_neutral_fit fit;

	(void)state;
	begin("rest", 6, RATE_HZ);
	rest.count = layout.marker_count;
	for (uint32_t i = 0; i < rest.count; i++) {
		const struct layout_marker *m = &layout.markers[i];

		rest.shots[i] = 10;
		rest.mean_m[i] = m->neutral_m;
		if (strncmp(m->group, "lip", 3) == 0 || strcmp(m->group, "chin") == 0)
			rest.mean_m[i].y -= 6 * MM;
	}
	fit = actor_rest_fit(&rest, &layout);
	assert_false(fit.is_neutral);
	assert_true(fit.far > 10 && fit.shared_max_m > 4 * MM);
	sim_play_finish(&play);
}

static void a_blink_does_not_end_a_rest(void **state)
{
	static struct actor_rest_finder finder;
	static struct actor_rest ended;
	static struct actor_shot shot;

	(void)state;
	begin("rest", 7, RATE_HZ);
	actor_rest_begin(&finder);
	for (uint64_t n = 0; n < 120; n++) {
		take_shot(n, &shot);
		for (uint32_t i = 0; n > 60 && n < 75 && i < shot.count; i++)
			if (strcmp(layout.markers[i].group, "lid") == 0)
				shot.p_m[i].y -= 4 * MM;
		assert_false(actor_rest_step(&finder, &shot, &ended));
	}
	assert_true(actor_rest_s(&finder.run) > 1.7);
	for (uint32_t i = 0; i < shot.count; i++)
		if (finder.run.shots[i])
			assert_true(vec3_distance(finder.run.mean_m[i],
						  layout.markers[i].neutral_m) < 0.1 * MM);
	sim_play_finish(&play);
}

static int finish_parts(void **state)
{
	(void)state;
	actor_part_finish(&performed.neutral);
	for (int k = 0; k < ACTOR_POSE_COUNT; k++)
		actor_part_finish(&performed.poses[k]);
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_script_is_the_simulators),
		cmocka_unit_test(every_pose_is_seen_once_and_in_its_time),
		cmocka_unit_test(neutral_and_ranges_are_the_truths),
		cmocka_unit_test(neighbours_move_together_and_are_not_across_the_lips),
		cmocka_unit_test(an_actors_file_is_read_as_it_was_written),
		cmocka_unit_test(a_takes_first_neutral_is_found),
		cmocka_unit_test(a_rest_is_neutral_at_both_ends),
		cmocka_unit_test(a_take_without_neutral_has_none),
		cmocka_unit_test(a_held_expression_is_no_neutral),
		cmocka_unit_test(a_blink_does_not_end_a_rest),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, finish_parts);
}
