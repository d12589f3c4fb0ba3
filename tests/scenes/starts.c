/*
 * A station that starts while the actor talks: many seeds, many starts, each from nothing. Prints
 * how many names were wrong and how soon the right ones were there; STARTS_VERBOSE=1 says which
 * starts went wrong. scene_starts [scene] [first_seed] [seeds] [starts] [seconds] [cameras]
 * [rate_hz] [sigma_px] [merge_px] [lost_share] [strays] [speed_m_s]
 */
#include <stdio.h>
#include <stdlib.h>

#include "base/sort.h"
#include "sim/play.h"

#define START_EVERY_S 1.37

struct sums {
	uint64_t starts, bad_starts, wrong, slow_starts;
	double *right_share;
};

static double argument(int argc, char **argv, int index, double other)
{
	return argc > index ? atof(argv[index]) : other;
}

static void play_start(struct sim_play *stage, const struct sim_options *options,
		       const struct blob_play *play, uint64_t first, uint64_t shots,
		       struct sums *sums)
{
	struct score score;

	score_init(&score);
	tracker_state_init(&stage->state, sim_scene_layout(stage->scene));
	for (uint64_t n = first; n < first + shots; n++) {
		sim_play_shot_us(stage, play, n, 0);
		score_shot(&score, &stage->truth, &stage->set);
	}
	double named_s = (double)score.first_named_shot / options->rate_hz;
	sums->right_share[sums->starts++] = (double)score.right / (double)score.seen3;
	sums->wrong += score.wrong;
	sums->bad_starts += score.wrong > 0;
	sums->slow_starts += score.first_named_shot < 0 || named_s > 1;
	if (getenv("STARTS_VERBOSE") && score.wrong)
		printf("seed %lu start %.3f s: wrong %lu, right %.2f%%, named at %.2f s\n",
		       (unsigned long)options->seed, (double)first / options->rate_hz,
		       (unsigned long)score.wrong, 100 * sums->right_share[sums->starts - 1],
		       named_s);
}

int main(int argc, char **argv)
{
	static struct sim_play stage;
	struct sim_options options = {.scene = argc > 1 ? argv[1] : "talking",
				      .camera_count = (uint32_t)argument(argc, argv, 6, 8),
				      .rate_hz = argument(argc, argv, 7, 120),
				      .face_speed_m_s = argument(argc, argv, 12, 0)};
	struct blob_play play = {.sigma_px = argument(argc, argv, 8, 0),
				 .merge_px = argument(argc, argv, 9, 0),
				 .lost_share = argument(argc, argv, 10, 0),
				 .stray_count = (int)argument(argc, argv, 11, 0)};
	uint64_t first = (uint64_t)argument(argc, argv, 2, 1);
	uint64_t seeds = (uint64_t)argument(argc, argv, 3, 10);
	uint64_t starts = (uint64_t)argument(argc, argv, 4, 10);
	double seconds = argument(argc, argv, 5, 2);
	struct sums sums = {.right_share = calloc(seeds * starts, sizeof(double))};
	struct diag diag = {0};

	for (uint64_t seed = first; sums.right_share && seed < first + seeds; seed++) {
		options.seed = seed;
		if (sim_play_init(&stage, &options, &diag)) {
			diag_print(&diag, stderr);
			return 1;
		}
		for (uint64_t k = 0; k < starts; k++)
			play_start(&stage, &options, &play,
				   (uint64_t)((0.3 + START_EVERY_S * (double)k) * options.rate_hz),
				   (uint64_t)(seconds * options.rate_hz), &sums);
		sim_play_finish(&stage);
	}
	sort_doubles(sums.right_share, sums.starts);
	printf("%s, %u cameras: %lu starts, %lu with %lu wrong names; right: median %.2f%%, 10th "
	       "percentile %.2f%%, least %.2f%%; %lu took over 1 s\n",
	       options.scene, options.camera_count, (unsigned long)sums.starts,
	       (unsigned long)sums.bad_starts, (unsigned long)sums.wrong,
	       100 * sums.right_share[sums.starts / 2], 100 * sums.right_share[sums.starts / 10],
	       100 * sums.right_share[0], (unsigned long)sums.slow_starts);
	free(sums.right_share);
	return 0;
}
