/*
 * Counts right, wrong and missing names, and errors in units of metres and of claimed sigmas.
 */
#include "sim/score.h"

#include <math.h>
#include <string.h>

#define EXCLUDED_NEES 28.0 /* true covariances let this happen once in 300,000 times */
#define INSIDE_NEES 7.815  /* 95 % of a chi square of three degrees of freedom */
#define SWAPPED_NEARER 0.5 /* of the distance to its own place */
#define GHOST_NEAR_M 0.003 /* of the glossy surface */

void score_init(struct score *score)
{
	memset(score, 0, sizeof(*score));
	score->first_named_shot = -1;
	score->first_wrong_shot = -1;
}

double score_nees(struct vec3 e, const double c[6])
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

/* Distance to the nearest true marker but `label`. */
static double nearest_other_m(const struct sim_truth *truth, uint32_t label, struct vec3 p_stage_m)
{
	double least_m = INFINITY;

	for (uint32_t m = 0; m < truth->marker_count; m++)
		if (m != label && truth->markers[m].worn)
			least_m = fmin(least_m,
				       vec3_distance(truth->markers[m].p_stage_m, p_stage_m));
	return least_m;
}

static bool on_ghost(const struct sim_truth *truth, struct vec3 p_stage_m)
{
	for (uint32_t g = 0; g < truth->ghost_count; g++) {
		const struct sim_truth_ghost *ghost = &truth->ghosts[g];

		if (view_count(ghost->visible_mask) >= 2 &&
		    vec3_distance(ghost->centre_stage_m, p_stage_m) <
			    ghost->radius_m + GHOST_NEAR_M)
			return true;
	}
	return false;
}

enum score_verdict score_judge(const struct sim_truth *truth, uint32_t label,
			       const struct marker *marker)
{
	const struct sim_truth_marker *own = &truth->markers[label];
	struct vec3 e = vec3_sub(marker->p_stage_m, own->p_stage_m);
	double own_m = own->worn ? vec3_norm(e) : INFINITY;

	if (own_m < SCORE_NEAR_M && score_nees(e, marker->cov_m2) < EXCLUDED_NEES)
		return SCORE_RIGHT;
	double other_m = nearest_other_m(truth, label, marker->p_stage_m);

	if (other_m < SCORE_NEAR_M && other_m < SWAPPED_NEARER * own_m)
		return SCORE_SWAPPED;
	if (own_m < SCORE_NEAR_M)
		return SCORE_RIGHT;
	return on_ghost(truth, marker->p_stage_m) ? SCORE_GHOST : SCORE_OFF;
}

static void count_wrong(struct score *score, enum score_verdict verdict,
			const struct marker *marker, uint64_t shot)
{
	score->wrong++;
	score->swapped += verdict == SCORE_SWAPPED;
	score->ghosts += verdict == SCORE_GHOST;
	score->two_wrong += marker->status == MARKER_TWO_CAMERA;
	if (score->first_wrong_shot < 0)
		score->first_wrong_shot = (int64_t)shot;
}

static void count_in(struct score_bin *bin, double of_sigma, double e2_m2)
{
	bin->count++;
	bin->inside += of_sigma < INSIDE_NEES;
	bin->nees += of_sigma;
	bin->error2_m2 += e2_m2;
}

static void count_error(struct score *score, struct vec3 e, const struct marker *marker)
{
	int bin = marker->camera_count < 2 ? 0 : marker->camera_count - 2;
	double of_sigma = score_nees(e, marker->cov_m2), e2_m2 = vec3_dot(e, e);

	count_in(&score->bins[bin < SCORE_BINS ? bin : SCORE_BINS - 1], of_sigma, e2_m2);
	if (marker->status == MARKER_TWO_CAMERA) {
		score->two_right++;
		return;
	}
	score->measured++;
	score->error2_m2 += e2_m2;
	score->nees += of_sigma;
}

static void score_label(struct score *score, const struct sim_truth *truth, uint32_t label,
			const struct marker_set *set)
{
	const struct sim_truth_marker *own = &truth->markers[label];
	const struct marker *marker = &set->markers[label];
	struct vec3 e = vec3_sub(marker->p_stage_m, own->p_stage_m);
	int views = view_count(own->visible_mask & ~set->missing_mask);

	score->seen3 += views >= 3;
	if (marker->status < MARKER_TWO_CAMERA) {
		score->unnamed += views >= 3;
		if (marker->status == MARKER_PREDICTED && own->worn)
			count_in(&score->predicted, score_nees(e, marker->cov_m2), vec3_dot(e, e));
		return;
	}
	enum score_verdict verdict = score_judge(truth, label, marker);
	bool sure = (double)marker->confidence >= SCORE_SURE;

	score->sure += sure;
	score->sure_wrong += sure && verdict != SCORE_RIGHT;
	score->unseen += views < 2;
	if (verdict != SCORE_RIGHT) {
		count_wrong(score, verdict, marker, set->shot);
		return;
	}
	score->right += views >= 3;
	count_error(score, e, marker);
}

static void score_unnamed_point(struct score *score, const struct sim_truth *truth,
				const struct marker *marker)
{
	score->stray += nearest_other_m(truth, UINT32_MAX, marker->p_stage_m) >= SCORE_NEAR_M;
}

static void score_head(struct score *score, const struct sim_truth *truth, const struct head *head)
{
	const struct vec3 nose = {0, 0, 0.1};

	if (!head->valid)
		return;
	double error_m = vec3_distance(pose_apply(&head->rt_stage_head, nose),
				       pose_apply(&truth->actors[0].rt_stage_head, nose));

	score->head_error2_m2 += error_m * error_m;
	score->heads++;
}

void score_shot(struct score *score, const struct sim_truth *truth, const struct marker_set *set)
{
	uint64_t right = score->right, seen3 = score->seen3;

	for (uint32_t i = 0; i < set->label_count; i++)
		score_label(score, truth, i, set);
	for (uint32_t i = set->label_count; i < set->marker_count; i++)
		score_unnamed_point(score, truth, &set->markers[i]);
	score_head(score, truth, &set->heads[0]);
	if (score->first_named_shot < 0 &&
	    score->right - right > 0.9 * (double)(score->seen3 - seen3))
		score->first_named_shot = (int64_t)score->shots;
	score->shots++;
}
