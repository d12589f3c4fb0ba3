/*
 * Of the names with a confidence of c or more, c at least are right: held against the truth of runs
 * that are hard enough for wrong names.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "sim/play.h"

#define BINS 4

static const double BIN_FROM[BINS] = {0, 0.97, 0.98, 0.99};

struct bins {
	double count[BINS], wrong[BINS];
};

struct run {
	struct sim_options options;
	struct blob_play play;
	uint64_t first, count;
};

static const struct run RUNS[] = {
	{{.scene = "talking", .seed = 3, .camera_count = 6, .rate_hz = 120, .face_speed_m_s = 1},
	 {.sigma_px = 0.3, .lost_share = 0.1, .stray_count = 40},
	 600,
	 240},
	{{.scene = "10-no-neutral", .seed = 2, .camera_count = 8, .rate_hz = 120},
	 {.lost_share = 0.1, .stray_count = 10},
	 0,
	 240},
	{{.scene = "dense-thirty", .seed = 1, .rate_hz = 30, .face_speed_m_s = 0.8},
	 {.sigma_px = 0},
	 0,
	 120},
	{{.scene = "talking", .seed = 4, .camera_count = 4, .rate_hz = 60, .face_speed_m_s = 1},
	 {.sigma_px = 0.1, .lost_share = 0.1, .stray_count = 10},
	 420,
	 180},
};

static void play(const struct run *run, struct bins *bins)
{
	static struct sim_play stage;

	memset(&stage, 0, sizeof(stage));
	assert_int_equal(sim_play_init(&stage, &run->options, NULL), 0);
	for (uint64_t n = run->first; n < run->first + run->count; n++) {
		sim_play_shot_us(&stage, &run->play, n, 0);
		for (uint32_t i = 0; i < stage.set.label_count; i++) {
			const struct marker *marker = &stage.set.markers[i];
			int bin = BINS - 1;

			if (marker->status != MARKER_MEASURED)
				continue;
			while ((double)marker->confidence < BIN_FROM[bin])
				bin--;
			bins->count[bin]++;
			bins->wrong[bin] += score_judge(&stage.truth, i, marker) != SCORE_RIGHT;
		}
	}
	sim_play_finish(&stage);
}

/* Who asks for 0.99 alone gets hardly a wrong name in any scene. */
static void sure_names_are_right_in_each_scene(void **state)
{
	(void)state;
	for (size_t k = 0; k < sizeof(RUNS) / sizeof(RUNS[0]); k++) {
		struct bins bins = {0};

		play(&RUNS[k], &bins);
		print_message("# %s: %.0f of %.0f sure names are wrong\n", RUNS[k].options.scene,
			      bins.wrong[BINS - 1], bins.count[BINS - 1]);
		assert_true(bins.wrong[BINS - 1] <= 0.001 * bins.count[BINS - 1]);
	}
}

static void confidence_is_the_chance_of_a_right_name(void **state)
{
	struct bins bins = {0};
	double count = 0, wrong = 0, before = 0;

	(void)state;
	for (size_t k = 0; k < sizeof(RUNS) / sizeof(RUNS[0]); k++)
		play(&RUNS[k], &bins);
	for (int b = BINS - 1; b >= 0; b--) {
		count += bins.count[b];
		wrong += bins.wrong[b];
		print_message("# from %.2f: %.0f names, %.3f %% wrong\n", BIN_FROM[b], count,
			      100 * wrong / count);
		assert_true(wrong <= (1 - BIN_FROM[b]) * count);
		assert_true(wrong / count >= before); /* the surer, the fewer */
		before = wrong / count;
	}
	assert_true(bins.count[BINS - 1] > 10000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(confidence_is_the_chance_of_a_right_name),
		cmocka_unit_test(sure_names_are_right_in_each_scene),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
