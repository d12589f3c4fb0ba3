/*
 * A marker that is filled in claims an error, too: held against the truth of runs in which markers
 * hide under lids, in folds, behind a hand and behind the jaw.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "sim/play.h"

struct run {
	struct sim_options options;
	uint64_t first, count;
};

static const struct run RUNS[] = {
	{{.scene = "talking", .seed = 21, .camera_count = 4, .face_speed_m_s = 0.7}, 0, 960},
	{{.scene = "02-hidden", .seed = 22, .face_speed_m_s = 0.5}, 600, 600},
	{{.scene = "04-head-shake", .seed = 23, .face_speed_m_s = 0.9}, 0, 960},
	{{.scene = "11-body-and-face", .seed = 24, .face_speed_m_s = 0.8}, 0, 600},
	{{.scene = "dense-thirty", .seed = 25}, 0, 450},
};

static void play(const struct run *run, struct score *score)
{
	static struct sim_play stage;
	static const struct blob_play blobs;

	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &run->options, NULL), 0);
	for (uint64_t n = run->first; n < run->first + run->count; n++) {
		sim_play_shot_us(&stage, &blobs, n, 0);
		score_shot(score, &stage.truth, &stage.set);
	}
	sim_play_finish(&stage);
}

static void what_is_filled_in_is_where_its_covariance_says(void **state)
{
	struct score_bin all = {0};

	(void)state;
	for (size_t k = 0; k < sizeof(RUNS) / sizeof(RUNS[0]); k++) {
		struct score score;

		score_init(&score);
		play(&RUNS[k], &score);
		const struct score_bin *bin = &score.predicted;
		double count = (double)bin->count;
		print_message("# %s: %.0f, NEES / 3 = %.2f, %.1f %% in their 95 %% ellipsoids\n",
			      RUNS[k].options.scene, count, bin->nees / count / 3,
			      100 * (double)bin->inside / count);
		assert_true(count > 100);
		assert_true(bin->nees < 3 * 2.5 * count);
		all.count += bin->count;
		all.nees += bin->nees;
		all.inside += bin->inside;
	}
	assert_true(all.nees / (double)all.count > 3 * 0.3);
	assert_true(all.nees / (double)all.count < 3 * 1.5);
	assert_true((double)all.inside > 0.9 * (double)all.count);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_filled_in_is_where_its_covariance_says),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
