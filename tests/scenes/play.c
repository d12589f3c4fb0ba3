/*
 * Plays a scene at blob level through the tracker and prints the score; PLAY_VERBOSE=1 says what
 * went wrong where. scene_play [scene] [seed] [seconds] [cameras] [rate_hz] [sigma_px] [merge_px]
 * [lost_share] [strays] [start_s]
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/sort.h"
#include "sim/play.h"

/* Cameras of a nameless point at that place, 0 when there is none. */
static int point_near(const struct marker_set *set, struct vec3 p_stage_m)
{
	for (uint32_t i = set->label_count; i < set->marker_count; i++)
		if (vec3_distance(set->markers[i].p_stage_m, p_stage_m) < SCORE_NEAR_M)
			return set->markers[i].camera_count;
	return 0;
}

static void print_wrong(const struct sim_play *stage, const struct sim_truth *truth,
			const struct marker_set *set)
{
	for (uint32_t i = 0; i < set->label_count; i++) {
		const struct marker *m = &set->markers[i];
		double e = vec3_distance(m->p_stage_m, truth->markers[i].p_stage_m);
		int views = __builtin_popcount(truth->markers[i].visible_mask);

		if (m->status >= MARKER_TWO_CAMERA && e > SCORE_NEAR_M)
			printf("shot %lu wrong %s %.2f mm status %d cams %d truth views %d\n",
			       (unsigned long)set->shot,
			       sim_scene_layout(stage->scene)->markers[i].name, e * 1e3, m->status,
			       m->camera_count, views);
		if (m->status < MARKER_TWO_CAMERA && views >= 3)
			printf("shot %lu unnamed %s status %d e %.2f truth views %d, point %d\n",
			       (unsigned long)set->shot,
			       sim_scene_layout(stage->scene)->markers[i].name, m->status, e * 1e3,
			       views, point_near(set, truth->markers[i].p_stage_m));
	}
}

static void print_head(const struct sim_truth *truth, const struct marker_set *set)
{
	struct vec3 nose = {0, 0, 0.1};
	int named = 0;

	for (uint32_t i = 0; i < set->label_count; i++)
		named += set->markers[i].status >= MARKER_TWO_CAMERA;
	printf("shot %lu head valid %d rigid %d error %.2f mm residual %.2f mm named %d points "
	       "%u\n",
	       (unsigned long)set->shot, set->heads[0].valid, set->heads[0].rigid_count,
	       1e3 * vec3_distance(pose_apply(&set->heads[0].rt_stage_head, nose),
				   pose_apply(&truth->actors[0].rt_stage_head, nose)),
	       1e3 * set->heads[0].residual_m, named, set->marker_count - set->label_count);
}

static double argument(int argc, char **argv, int index, double other)
{
	return argc > index ? atof(argv[index]) : other;
}

int main(int argc, char **argv)
{
	static struct sim_play stage;
	struct sim_options options = {.scene = argc > 1 ? argv[1] : "talking",
				      .seed = (uint64_t)argument(argc, argv, 2, 1),
				      .camera_count = (uint32_t)argument(argc, argv, 4, 8),
				      .rate_hz = argument(argc, argv, 5, 120)};
	struct blob_play play = {.sigma_px = argument(argc, argv, 6, 0),
				 .merge_px = argument(argc, argv, 7, 0),
				 .lost_share = argument(argc, argv, 8, 0),
				 .stray_count = (int)argument(argc, argv, 9, 0)};
	uint64_t start = (uint64_t)(argument(argc, argv, 10, 0) * options.rate_hz);
	uint64_t shots = (uint64_t)(argument(argc, argv, 3, 10) * options.rate_hz);
	double *times_us = calloc(shots, sizeof(*times_us));
	struct score score;

	struct diag diag = {0};

	if (sim_play_init(&stage, &options, &diag) || !times_us) {
		diag_print(&diag, stderr);
		return 1;
	}
	score_init(&score);
	for (uint64_t n = start; n < start + shots; n++) {
		times_us[n - start] = sim_play_shot_us(&stage, &play, n, 0);
		score_shot(&score, &stage.truth, &stage.set);
		if (getenv("PLAY_VERBOSE")) {
			print_wrong(&stage, &stage.truth, &stage.set);
			print_head(&stage.truth, &stage.set);
		}
	}
	sort_doubles(times_us, shots);
	printf("%s seed %lu: seen3 %lu right %.3f%% unnamed %.3f%% wrong %lu two %lu/%lu stray %lu "
	       "rms %.4f mm nees/3 %.2f pred %lu rms %.2f mm head %.3f mm (%lu of %lu) named at "
	       "%ld; "
	       "us p50 %.0f p99 %.0f max %.0f\n",
	       options.scene, (unsigned long)options.seed, (unsigned long)score.seen3,
	       100.0 * (double)score.right / (double)score.seen3,
	       100.0 * (double)score.unnamed / (double)score.seen3, (unsigned long)score.wrong,
	       (unsigned long)score.two_right, (unsigned long)score.two_wrong,
	       (unsigned long)score.stray, 1e3 * sqrt(score.error2_m2 / (double)score.measured),
	       score.nees / (double)score.measured / 3, (unsigned long)score.predicted.count,
	       1e3 * sqrt(score.predicted.error2_m2 / (double)score.predicted.count),
	       1e3 * sqrt(score.head_error2_m2 / (double)score.heads), (unsigned long)score.heads,
	       (unsigned long)score.shots, (long)score.first_named_shot, times_us[shots / 2],
	       times_us[shots * 99 / 100], times_us[shots - 1]);
	free(times_us);
	sim_play_finish(&stage);
	return 0;
}
