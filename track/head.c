/*
 * Robust rigid fits: rigid markers weigh most, skin helps when they are hidden, and whatever
 * disagrees loses its weight (Geman-McClure).
 */
#include "track/head.h"

#include "track/rigid.h"

#define CARRY_MAX_S 0.1      /* the head's velocity is carried on this long */
#define NEAR_M 0.008         /* how far a point may be from where a marker is expected */
#define RIGID_SIGMA_M 0.0001 /* how stiff a jig is */
#define SKIN_SHARED 3.0
#define FIRST_RIGID_SIGMA_M 0.0003 /* against predictions */
#define FIRST_SKIN_SIGMA_M 0.003
#define REST_SIGMA_MIN_M 0.0005
#define ROBUST_RIGID_M 0.0015 /* errors beyond this lose their weight */
#define ROBUST_SKIN_M 0.005
#define ROUNDS 4
#define AGREE_MIN 3
#define CLOSE_RIGID_M 0.0015
#define CLOSE_SKIN_M 0.002
#define CLOSE_SHARE 0.3       /* of the pairs, where the rigid markers agree */
#define CLOSE_SHARE_ALONE 0.6 /* ... and where they do not show */
#define SETTLED_M 0.0015      /* a shorter move pairs nothing anew */

struct pose head_predict(const struct head_state *head, int64_t now_ns)
{
	double dt_s = fmin((double)(now_ns - head->seen_ns) * 1e-9, CARRY_MAX_S);
	struct pose turn = pose_from_rotation_vector(vec3_scale(head->turn_rate_rad_s, dt_s));
	struct pose turned = head->rt_stage_head;

	turned.t = (struct vec3){0, 0, 0};
	turned = pose_compose(&turn, &turned);
	turned.t = vec3_add(head->rt_stage_head.t, vec3_scale(head->velocity_m_s, dt_s));
	return turned;
}

static int nearest_point(const struct point *points, uint32_t point_count, struct vec3 expected,
			 double *distance2_m2)
{
	int best = -1;

	*distance2_m2 = NEAR_M * NEAR_M;
	for (uint32_t p = 0; p < point_count; p++) {
		struct vec3 d = vec3_sub(points[p].fix.p_stage_m, expected);
		double d2 = vec3_dot(d, d);

		if (d2 < *distance2_m2) {
			*distance2_m2 = d2;
			best = (int)p;
		}
	}
	return best;
}

/* Nearest point to each predicted marker, each point taken only by the marker nearest to it. */
static void pair_up(const struct predictions *predictions, const struct point *points,
		    uint32_t point_count, const struct pose *pose, int16_t *point_of_label)
{
	double taken_m2[POINT_MAX];
	int16_t taken_by[POINT_MAX];

	for (uint32_t p = 0; p < point_count; p++)
		taken_by[p] = LABEL_NONE;
	for (uint32_t i = 0; i < predictions->count; i++) {
		double distance2_m2;

		point_of_label[i] = -1;
		if (!predictions->fresh_start && !predictions->labels[i].recent)
			continue;
		int best = nearest_point(points, point_count,
					 pose_apply(pose, predictions->labels[i].local_m),
					 &distance2_m2);
		if (best < 0 || (taken_by[best] >= 0 && distance2_m2 >= taken_m2[best]))
			continue;
		if (taken_by[best] >= 0)
			point_of_label[taken_by[best]] = -1;
		taken_m2[best] = distance2_m2;
		taken_by[best] = (int16_t)i;
		point_of_label[i] = (int16_t)best;
	}
}

struct fit_pairs {
	int count, rigid_count;
	struct rigid_pair pairs[LABEL_MAX];
	bool rigid[LABEL_MAX];
	double sigma_m[LABEL_MAX];
};

/* Starting from `pose`, rounds of weighting by the error and fitting. */
static bool fit_robustly(struct fit_pairs *fit, struct pose *pose)
{
	int agree = 0;

	for (int round = 0; round < ROUNDS; round++) {
		agree = 0;
		for (int i = 0; i < fit->count; i++) {
			double sigma_m = fit->sigma_m[i];
			double scale_m =
				fmax(2 * sigma_m, fit->rigid[i] ? ROBUST_RIGID_M : ROBUST_SKIN_M);
			/* the guess may be far off: begin wide */
			scale_m *= round == 0 ? 6 : round == 1 ? 2 : 1;
			double ratio = rigid_error(&fit->pairs[i], pose) / scale_m;
			double trust = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));

			fit->pairs[i].weight = trust / (sigma_m * sigma_m);
			agree += ratio < 1;
		}
		if (rigid_fit(fit->pairs, fit->count, pose))
			return false;
	}
	return agree >= AGREE_MIN && agree * 3 >= fit->count;
}

double head_distance_m(const struct pose *a, const struct pose *b)
{
	struct vec3 nose = {0, 0, 0.1}, crown = {0, 0.1, 0};

	return fmax(vec3_distance(pose_apply(a, nose), pose_apply(b, nose)),
		    vec3_distance(pose_apply(a, crown), pose_apply(b, crown)));
}

/* A head that settled one marker aside pairs most markers too, but few of them closely, and never
 * the rigid ones. */
static bool is_convincing(const struct layout *layout, const struct predictions *predictions,
			  const struct fit_pairs *fit, const struct pose *pose)
{
	int close = 0, rigid_close = 0, rigid_recent = 0;

	for (uint32_t i = 0; i < predictions->count; i++)
		rigid_recent += layout->markers[i].rigid && predictions->labels[i].recent;
	for (int i = 0; i < fit->count; i++) {
		bool is_close = rigid_error(&fit->pairs[i], pose) <
				(fit->rigid[i] ? CLOSE_RIGID_M : CLOSE_SKIN_M);

		close += is_close;
		rigid_close += is_close && fit->rigid[i];
	}
	double share = (double)close / fit->count;

	if (close < AGREE_MIN || share < CLOSE_SHARE)
		return false;
	return rigid_recent < 3 || rigid_close >= 2 || share >= CLOSE_SHARE_ALONE;
}

bool head_refine(const struct layout *layout, const struct predictions *predictions,
		 const struct point *points, uint32_t point_count, struct pose *pose)
{
	int16_t point_of_label[LABEL_MAX];
	struct pose refined = *pose;
	struct fit_pairs fit;

	for (int again = 0; again < 2; again++) {
		struct pose before = refined;

		fit.count = fit.rigid_count = 0;
		pair_up(predictions, points, point_count, &refined, point_of_label);
		for (uint32_t i = 0; i < predictions->count; i++) {
			if (point_of_label[i] < 0)
				continue;
			fit.rigid[fit.count] = layout->markers[i].rigid;
			fit.sigma_m[fit.count] =
				layout->markers[i].rigid ? FIRST_RIGID_SIGMA_M : FIRST_SKIN_SIGMA_M;
			fit.pairs[fit.count++] =
				(struct rigid_pair){predictions->labels[i].local_m,
						    points[point_of_label[i]].fix.p_stage_m, 1};
		}
		if (fit.count < AGREE_MIN || !fit_robustly(&fit, &refined))
			return false;
		if (head_distance_m(&before, &refined) < SETTLED_M)
			break;
	}
	if (!is_convincing(layout, predictions, &fit, &refined))
		return false;
	*pose = refined;
	return true;
}

static void collect_named(const struct layout *layout, const struct tracker_state *state,
			  const struct point *points, const int16_t *point_of_label,
			  struct fit_pairs *fit)
{
	for (uint32_t i = 0; i < layout->marker_count; i++)
		fit->rigid_count += layout->markers[i].rigid && point_of_label[i] >= 0;
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		bool rigid = layout->markers[i].rigid;
		const struct label_state *label = &state->labels[i];

		if (point_of_label[i] < 0)
			continue;
		const struct point *point = &points[point_of_label[i]];
		/* Skin moves together: many markers of it are worth a few. */
		double still_m =
			rigid ? RIGID_SIGMA_M
			      : SKIN_SHARED * (sqrt(label->rest_variance_m2) + REST_SIGMA_MIN_M);
		fit->rigid[fit->count] = rigid;
		fit->sigma_m[fit->count] = hypot(still_m, fix_noise_m(&point->fix));
		fit->pairs[fit->count++] =
			(struct rigid_pair){rigid ? layout->markers[i].neutral_m : label->rest_m,
					    point->fix.p_stage_m, 1};
	}
}

/* Rms distance over the rigid markers, or over all where there are none. */
static double fit_residual_m(const struct fit_pairs *fit, const struct pose *pose)
{
	double sum_m2 = 0;
	int count = 0;

	for (int i = 0; i < fit->count; i++) {
		if (!fit->rigid[i] && fit->rigid_count > 0)
			continue;
		double error_m = rigid_error(&fit->pairs[i], pose);
		sum_m2 += error_m * error_m;
		count++;
	}
	return sqrt(sum_m2 / count);
}

void head_fit(const struct layout *layout, const struct tracker_state *state,
	      const struct point *points, const int16_t *point_of_label, const struct pose *guess,
	      struct head *out)
{
	struct fit_pairs fit;
	struct pose pose = *guess;

	fit.count = fit.rigid_count = 0;
	out->valid = 0;
	collect_named(layout, state, points, point_of_label, &fit);
	if (fit.count < AGREE_MIN || !fit_robustly(&fit, &pose))
		return;
	out->valid = 1;
	out->rigid_count = (uint8_t)(fit.rigid_count > UINT8_MAX ? UINT8_MAX : fit.rigid_count);
	out->rt_stage_head = pose;
	out->residual_m = fit_residual_m(&fit, &pose);
}

void head_update(struct head_state *head, const struct pose *pose, int64_t now_ns)
{
	double dt_s = (double)(now_ns - head->seen_ns) * 1e-9;

	head->velocity_m_s = head->turn_rate_rad_s = (struct vec3){0, 0, 0};
	if (head->tracked && dt_s > 0 && dt_s <= CARRY_MAX_S) {
		struct pose back = pose_inverse(&head->rt_stage_head);
		struct pose turn = pose_compose(pose, &back);

		head->turn_rate_rad_s = vec3_scale(pose_to_rotation_vector(&turn), 1 / dt_s);
		head->velocity_m_s = vec3_scale(vec3_sub(pose->t, head->rt_stage_head.t), 1 / dt_s);
	}
	head->rt_stage_head = *pose;
	head->seen_ns = now_ns;
	head->tracked = true;
}
