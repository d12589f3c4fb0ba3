/*
 * Counts right, wrong and missing names, and errors in units of metres and of claimed sigmas.
 */
#include "sim/score.h"

#include <math.h>
#include <string.h>

void score_init(struct score *score)
{
	memset(score, 0, sizeof(*score));
	score->first_named_shot = -1;
}

/* e' C^-1 e */
static double nees(struct vec3 e, const double c[6])
{
	double l00 = sqrt(c[0]), l10 = c[1] / l00, l20 = c[2] / l00;
	double l11 = sqrt(c[3] - l10 * l10), l21 = (c[4] - l20 * l10) / l11;
	double l22 = sqrt(c[5] - l20 * l20 - l21 * l21);
	double a = e.x / l00, b = (e.y - l10 * a) / l11, d = (e.z - l20 * a - l21 * b) / l22;

	return a * a + b * b + d * d;
}

static int view_count(uint32_t mask)
{
	return __builtin_popcount(mask);
}

static void score_label(struct score *score, const struct sim_truth_marker *truth,
			const struct marker *marker)
{
	struct vec3 e = vec3_sub(marker->p_stage_m, truth->p_stage_m);
	bool near = vec3_norm(e) < SCORE_NEAR_M;
	bool seen3 = view_count(truth->visible_mask) >= 3;

	score->seen3 += seen3;
	if (marker->status == MARKER_MISSING || marker->status == MARKER_PREDICTED) {
		score->unnamed += seen3;
		if (marker->status == MARKER_PREDICTED) {
			score->predicted++;
			score->predicted2_m2 += vec3_dot(e, e);
		}
		return;
	}
	if (!near) {
		score->wrong++;
		return;
	}
	score->right += seen3;
	if (marker->status == MARKER_TWO_CAMERA) {
		score->two_right++;
		return;
	}
	score->measured++;
	score->error2_m2 += vec3_dot(e, e);
	score->nees += nees(e, marker->cov_m2);
}

static void score_unnamed_point(struct score *score, const struct sim_truth *truth,
				const struct marker *marker)
{
	for (uint32_t m = 0; m < truth->marker_count; m++)
		if (vec3_distance(truth->markers[m].p_stage_m, marker->p_stage_m) < SCORE_NEAR_M)
			return;
	score->stray++;
}

void score_shot(struct score *score, const struct sim_truth *truth, const struct marker_set *set)
{
	uint64_t right = score->right, seen3 = score->seen3;

	for (uint32_t i = 0; i < set->label_count; i++)
		score_label(score, &truth->markers[i], &set->markers[i]);
	for (uint32_t i = set->label_count; i < set->marker_count; i++)
		score_unnamed_point(score, truth, &set->markers[i]);
	if (set->heads[0].valid) {
		struct vec3 nose = {0, 0, 0.1};
		double error_m = vec3_distance(pose_apply(&set->heads[0].rt_stage_head, nose),
					       pose_apply(&truth->actors[0].rt_stage_head, nose));
		score->head_error2_m2 += error_m * error_m;
		score->heads++;
	}
	if (score->first_named_shot < 0 &&
	    score->right - right > 0.9 * (double)(score->seen3 - seen3))
		score->first_named_shot = (int64_t)score->shots;
	score->shots++;
}
