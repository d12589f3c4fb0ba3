/*
 * Scenes played through the tracker without a station: faults reach it as a station would let them.
 */
#include "sim/play.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct sim_play play;
static const struct blob_play BLOBS = {0};

static void start(const struct sim_fault *fault, bool pixels)
{
	struct sim_faults faults = {.count = fault != NULL};
	const struct sim_options options = {.scene = "rest", .seed = 3, .faults = &faults};

	if (fault) {
		faults.faults[0] = *fault;
		faults.faults[0].every = 1;
		strcpy(faults.faults[0].device, "ir1");
	}
	assert_int_equal(sim_play_init(&play, &options, NULL), 0);
	if (pixels)
		assert_int_equal(sim_play_use_pixels(&play, SIM_NOISE_FAST, NULL), 0);
}

static void run(uint64_t first, uint64_t count)
{
	for (uint64_t n = first; n < first + count; n++)
		sim_play_shot_us(&play, &BLOBS, n, 0);
}

static void cameras_that_hand_nothing_over_are_missing(void **state)
{
	static const struct sim_fault faults[] = {{.kind = SIM_FAULT_DROP},
						  {.kind = SIM_FAULT_MISS},
						  {.kind = SIM_FAULT_FREEZE},
						  {.kind = SIM_FAULT_UNPLUG},
						  {.kind = SIM_FAULT_DELAY, .delay_ms = 60}};

	(void)state;
	for (size_t i = 0; i < sizeof(faults) / sizeof(*faults); i++) {
		start(&faults[i], false);
		run(0, 3);
		assert_int_equal(play.set.missing_mask, 2);
		sim_play_finish(&play);
	}
}

static void a_short_delay_is_waited_for(void **state)
{
	(void)state;
	start(&(struct sim_fault){.kind = SIM_FAULT_DELAY, .delay_ms = 10}, false);
	run(0, 3);
	assert_int_equal(play.set.missing_mask, 0);
	sim_play_finish(&play);
}

static void without_strobe_there_are_no_blobs(void **state)
{
	(void)state;
	for (int pixels = 0; pixels < 2; pixels++) {
		start(&(struct sim_fault){.kind = SIM_FAULT_DARK}, pixels);
		run(0, 1);
		assert_true(play.sets[0].blob_count > 30);
		assert_true(play.sets[1].blob_count < 3);
		sim_play_finish(&play);
	}
}

static double saturated_share(const struct blob_set *set)
{
	uint32_t count = 0;

	for (uint32_t b = 0; b < set->blob_count; b++)
		count += (set->blobs[b].flags & BLOB_SATURATED) != 0;
	return (double)count / set->blob_count;
}

static void a_stuck_exposure_saturates_at_both_levels(void **state)
{
	(void)state;
	for (int pixels = 0; pixels < 2; pixels++) {
		start(&(struct sim_fault){.kind = SIM_FAULT_STUCK_EXPOSURE}, pixels);
		run(0, 1);
		assert_true(saturated_share(&play.sets[0]) < 0.2);
		assert_true(saturated_share(&play.sets[1]) > 0.5);
		sim_play_finish(&play);
	}
}

static const struct blob *nearest(const struct blob_set *set, const double pixel[2])
{
	const struct blob *best = &set->blobs[0];

	for (uint32_t b = 1; b < set->blob_count; b++)
		if (hypot(set->blobs[b].x_px - pixel[0], set->blobs[b].y_px - pixel[1]) <
		    hypot(best->x_px - pixel[0], best->y_px - pixel[1]))
			best = &set->blobs[b];
	return best;
}

/* Mean distance of a camera's blobs from where the rig has the markers that it sees. */
static double shift_px(uint32_t camera)
{
	double x_px = 0, y_px = 0;
	int count = 0;

	for (uint32_t m = 0; m < play.truth.marker_count; m++) {
		double pixel[2];

		if (!(play.truth.markers[m].visible_mask >> camera & 1) ||
		    !view_project(&play.rig.views[camera], play.truth.markers[m].p_stage_m, pixel,
				  NULL))
			continue;
		const struct blob *blob = nearest(&play.sets[camera], pixel);

		if (blob->flags || hypot(blob->x_px - pixel[0], blob->y_px - pixel[1]) > 4)
			continue;
		x_px += blob->x_px - pixel[0];
		y_px += blob->y_px - pixel[1];
		count++;
	}
	assert_true(count > 20);
	return hypot(x_px, y_px) / count;
}

static void a_bump_turns_the_camera_at_both_levels_and_it_stays(void **state)
{
	const struct sim_fault bump = {.kind = SIM_FAULT_BUMP, .at_s = 0.1, .angle_mrad = 1};

	(void)state;
	for (int pixels = 0; pixels < 2; pixels++) {
		start(&bump, pixels);
		run(11, 1);
		assert_true(shift_px(1) < 0.05);
		run(12, 1);
		double shift = shift_px(1);
		assert_true(shift > 1.4 && shift < 1.8); /* 1600 px of focal length */
		run(600, 1);
		assert_true(fabs(shift_px(1) - shift) < 0.05);
		assert_true(shift_px(0) < 0.05);
		sim_play_finish(&play);
	}
}

static void pixels_and_blobs_are_scored_alike(void **state)
{
	struct score score;

	(void)state;
	for (int pixels = 0; pixels < 2; pixels++) {
		start(NULL, pixels);
		score_init(&score);
		for (uint64_t n = 0; n < 12; n++) {
			run(n, 1);
			score_shot(&score, &play.truth, &play.set);
		}
		assert_true((double)score.right > 0.95 * (double)score.seen3);
		assert_int_equal(score.wrong, 0);
		assert_true(play.cost.truth_us > 0 && play.cost.blobs_us > 0 &&
			    play.cost.tracker_us > 0);
		sim_play_finish(&play);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cameras_that_hand_nothing_over_are_missing),
		cmocka_unit_test(a_short_delay_is_waited_for),
		cmocka_unit_test(without_strobe_there_are_no_blobs),
		cmocka_unit_test(a_stuck_exposure_saturates_at_both_levels),
		cmocka_unit_test(a_bump_turns_the_camera_at_both_levels_and_it_stays),
		cmocka_unit_test(pixels_and_blobs_are_scored_alike),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
