/*
 * How the markers are worn today: fallen ones are named, the day's offsets are taken off, a slipped
 * head band is found out.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sim/play.h"
#include "tests/unit/label_named.h"

static const struct blob_play CLEAN = {.sigma_px = 0.03, .merge_px = 2.5};
static struct sim_play play;

static void begin(const char *scene, uint64_t seed)
{
	struct sim_options options = {.scene = scene, .seed = seed, .rate_hz = 60};
	struct diag diag = {0};
	int err = sim_play_init(&play, &options, &diag);

	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
}

static void a_fallen_marker_is_gone_and_no_other(void **state)
{
	(void)state;
	begin("05-fallen-and-reapplied", 3);
	uint32_t fallen = label_named(&play, "cheek_l_3"), lent = label_named(&play, "brow_r_2");
	int gone_shots = 0;

	for (uint64_t n = 0; n < 16 * 60; n++) {
		sim_play_shot_us(&play, &CLEAN, n, 0);
		for (uint32_t i = 0; i < play.set.label_count; i++) {
			const struct marker *m = &play.set.markers[i];

			if (!(m->flags & MARKER_GONE))
				continue;
			assert_true(i == fallen || i == lent);
			assert_int_equal(m->status, MARKER_MISSING);
			assert_true(n > 8 * 60);
			gone_shots += i == fallen;
		}
	}
	assert_true(gone_shots > 5 * 60);
	/* found and put back, it has its name again */
	assert_int_equal(play.set.markers[lent].status, MARKER_MEASURED);
	assert_int_equal(play.set.markers[lent].flags & MARKER_GONE, 0);
	sim_play_finish(&play);
}

static void the_days_offsets_are_taken_off(void **state)
{
	(void)state;
	begin("05-fallen-and-reapplied", 4);
	const struct layout *layout = sim_scene_layout(play.scene);
	double stabilised2 = 0, normalised2 = 0;
	int count = 0;

	for (uint64_t n = 0; n < 100; n++)
		sim_play_shot_us(&play, &CLEAN, n, 0);
	for (uint32_t i = 0; i < play.set.label_count; i++) {
		const struct marker *m = &play.set.markers[i];
		struct vec3 wanted = layout->markers[i].neutral_m;

		if (m->status != MARKER_MEASURED || layout->markers[i].rigid)
			continue;
		assert_true(m->flags & MARKER_NORMALISED);
		struct vec3 s = {m->stabilised_m[0], m->stabilised_m[1], m->stabilised_m[2]};
		struct vec3 k = {m->normalised_m[0], m->normalised_m[1], m->normalised_m[2]};
		stabilised2 += pow(vec3_distance(s, wanted), 2);
		normalised2 += pow(vec3_distance(k, wanted), 2);
		count++;
	}
	print_message("# from the master: stabilised %.2f mm, normalised %.2f mm rms\n",
		      1e3 * sqrt(stabilised2 / count), 1e3 * sqrt(normalised2 / count));
	assert_true(sqrt(stabilised2 / count) > 0.8e-3);
	assert_true(sqrt(normalised2 / count) < 0.2e-3);
	sim_play_finish(&play);
}

static void an_expression_is_no_neutral(void **state)
{
	(void)state;
	begin("10-no-neutral", 5);
	for (uint64_t n = 0; n < 10 * 60; n++)
		sim_play_shot_us(&play, &CLEAN, n, 0);
	for (uint32_t i = 0; i < play.set.label_count; i++)
		if (!sim_scene_layout(play.scene)->markers[i].rigid)
			assert_int_equal(play.set.markers[i].flags & MARKER_NORMALISED, 0);
	sim_play_finish(&play);
}

static double head_error_m(void)
{
	struct vec3 nose = {0, 0, 0.1};

	return vec3_distance(pose_apply(&play.set.heads[0].rt_stage_head, nose),
			     pose_apply(&play.truth.actors[0].rt_stage_head, nose));
}

static void a_slipped_band_is_named_and_made_good(void **state)
{
	(void)state;
	begin("06-jig-slip", 6);
	double worst_m = 0;

	for (uint64_t n = 0; n < 20 * 60; n++) {
		sim_play_shot_us(&play, &CLEAN, n, 0);
		if (n < 7 * 60)
			assert_int_equal(play.set.heads[0].jig_slip, 0);
		if (n == 10 * 60) {
			assert_int_equal(play.set.heads[0].jig_slip, 1);
			print_message("# 3 mm read as %.2f mm\n", 1e3 * play.set.heads[0].slip_m);
			assert_true(fabs(play.set.heads[0].slip_m - 3e-3) < 1e-3);
		}
		if (n > 17 * 60)
			worst_m = fmax(worst_m, head_error_m());
	}
	print_message("# 9 mm in all read as %.2f mm, head within %.2f mm\n",
		      1e3 * play.set.heads[0].slip_m, 1e3 * worst_m);
	assert_true(fabs(play.set.heads[0].slip_m - 9e-3) < 2e-3);
	assert_true(worst_m < 1.5e-3);
	sim_play_finish(&play);
}

static void no_expression_is_a_slip(void **state)
{
	static const char *const scenes[] = {"01-lips-and-lids", "03-ghosts", "04-head-shake"};

	(void)state;
	for (int s = 0; s < 3; s++) {
		begin(scenes[s], 7);
		for (uint64_t n = 0; n < 12 * 60; n++)
			sim_play_shot_us(&play, &CLEAN, n, 0);
		assert_int_equal(play.set.heads[0].jig_slip, 0);
		sim_play_finish(&play);
	}
}

static bool is_true_marker(const struct marker *m)
{
	for (uint32_t i = 0; i < play.truth.marker_count; i++)
		if (vec3_distance(play.truth.markers[i].p_stage_m, m->p_stage_m) < 0.001)
			return true;
	return false;
}

static void teeth_and_eyes_are_learned_as_ghosts(void **state)
{
	(void)state;
	begin("03-ghosts", 8);
	int ghosts = 0, nameless = 0;

	for (uint64_t n = 0; n < 16 * 60; n++) {
		sim_play_shot_us(&play, &CLEAN, n, 0);
		for (uint32_t i = play.set.label_count; i < play.set.marker_count; i++) {
			const struct marker *m = &play.set.markers[i];

			if (is_true_marker(m))
				assert_int_equal(m->flags & MARKER_GHOST, 0);
			else if (n >= 10 * 60 && m->status == MARKER_MEASURED) {
				nameless++;
				ghosts += (m->flags & MARKER_GHOST) != 0;
			}
		}
	}
	print_message("# %d of %d nameless lights are named ghosts\n", ghosts, nameless);
	assert_true(nameless > 500 && ghosts > 0.9 * nameless);
	sim_play_finish(&play);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_fallen_marker_is_gone_and_no_other),
		cmocka_unit_test(the_days_offsets_are_taken_off),
		cmocka_unit_test(an_expression_is_no_neutral),
		cmocka_unit_test(a_slipped_band_is_named_and_made_good),
		cmocka_unit_test(no_expression_is_a_slip),
		cmocka_unit_test(teeth_and_eyes_are_learned_as_ghosts),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
