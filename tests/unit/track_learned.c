/*
 * A calibrated actor: what the file tells the tracker costs no names where they must be found in
 * the middle of speech, whether the markers sit where they were learned or were put on anew.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "calib/actor/actor_learn.h"
#include "calib/actor/actor_rest.h"
#include "sim/play.h"

#define SEED 1
#define LEARN_HZ 30
#define REST_S 2
#define SCRIPT_S 131
#define RATE_HZ 60
#define START_S 6
#define PLAYED_S 4

static const struct blob_play AS_OPTICS = {0};
static struct sim_play play;
static struct layout learned;

static void begin(const char *scene, double rate_hz)
{
	struct sim_options options = {.scene = scene, .seed = SEED, .rate_hz = rate_hz};

	memset(&play, 0, sizeof(play));
	assert_int_equal(sim_play_init(&play, &options, NULL), 0);
}

static void take_shot(uint64_t n, struct actor_part *part)
{
	static struct actor_shot shot;

	sim_play_shot_us(&play, &AS_OPTICS, n, 0);
	shot.mid_exposure_ns = play.set.mid_exposure_ns;
	shot.count = learned.marker_count;
	for (uint32_t i = 0; i < shot.count; i++) {
		const struct marker *m = &play.set.markers[i];

		shot.seen[i] = m->status == MARKER_MEASURED && m->flags & MARKER_STABILISED;
		shot.p_m[i] =
			(struct vec3){m->stabilised_m[0], m->stabilised_m[1], m->stabilised_m[2]};
	}
	assert_int_equal(actor_part_add(part, &shot), 0);
}

static int learn_actor(void **state)
{
	static struct actor_neutral neutral;
	struct actor_part rest = {0}, script = {0};

	(void)state;
	begin("range-of-motion", LEARN_HZ);
	actor_layout(sim_scene_layout(play.scene), 0, &learned);
	for (uint64_t n = 0; n < SCRIPT_S * LEARN_HZ; n++)
		take_shot(n, n < REST_S * LEARN_HZ ? &rest : &script);
	assert_int_equal(actor_neutral_learn(&rest, &neutral), 0);
	actor_learn(&learned, &neutral, &script, 1);
	actor_part_finish(&rest);
	actor_part_finish(&script);
	sim_play_finish(&play);
	return 0;
}

static void play_with(const char *scene, double start_s, const struct layout *layout,
		      struct score *score)
{
	begin(scene, RATE_HZ);
	if (layout) {
		play.tracker_rig.layout = layout;
		tracker_state_init(&play.state, layout);
	}
	uint64_t first = (uint64_t)(start_s * RATE_HZ);
	for (uint64_t n = first; n < first + PLAYED_S * RATE_HZ; n++) {
		sim_play_shot_us(&play, &AS_OPTICS, n, 0);
		score_shot(score, &play.truth, &play.set);
	}
	sim_play_finish(&play);
}

static double right_share(const struct score *score)
{
	return (double)score->right / (double)score->seen3;
}

static void a_calibrated_actor_is_tracked_no_worse(void **state)
{
	static const char *const scenes[] = {"10-no-neutral", "02-hidden", "06-jig-slip",
					     "05-fallen-and-reapplied"};

	(void)state;
	for (size_t k = 0; k < sizeof(scenes) / sizeof(scenes[0]); k++) {
		struct score plain, known;

		score_init(&plain);
		score_init(&known);
		play_with(scenes[k], START_S, NULL, &plain);
		play_with(scenes[k], START_S, &learned, &known);
		print_message("# %s: right %.3f and %.3f %%, wrong %llu and %llu\n", scenes[k],
			      100 * right_share(&plain), 100 * right_share(&known),
			      (unsigned long long)plain.wrong, (unsigned long long)known.wrong);
		assert_true(known.wrong <= plain.wrong);
		assert_true(right_share(&known) > right_share(&plain) - 0.002);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_calibrated_actor_is_tracked_no_worse),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, learn_actor, NULL);
}
