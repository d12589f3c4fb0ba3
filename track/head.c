/*
 * Robust rigid fits: rigid markers weigh most, skin helps when they are hidden, and whatever
 * disagrees loses its weight (Geman-McClure).
 */
#include "track/head.h"

#include "track/rigid.h"

#define GAP_MAX_S 0.1        /* velocity is not told over more */
#define RIGID_SIGMA_M 0.0001 /* how stiff a jig is */
#define BODY_SIGMA_M 0.002   /* ... and a suit on a limb */
#define SKIN_SHARED 3.0
#define REST_SIGMA_MIN_M 0.0005
#define ROUNDS 4
#define AGREE_MIN 3
#define CLOSE_SHARE 0.3       /* of the pairs, where the rigid markers agree */
#define CLOSE_SHARE_ALONE 0.6 /* ... and where they do not show */
#define SETTLED_M 0.0015      /* a shorter move pairs nothing anew */

/* How far a point may be from where a marker is expected, by enum label_kind as all of these. */
static const double NEAR_M[] = {0.008, 0.008, 0.020};
static const double FIRST_SIGMA_M[] = {0.003, 0.0003, 0.004}; /* against predictions */
static const double ROBUST_M[] = {0.005, 0.0015, 0.010};      /* errors beyond lose their weight */
static const double CLOSE_M[] = {0.002, 0.0015, 0.006};

struct pose head_predict(const struct frame_state *frame, int64_t now_ns)
{
	double dt_s = fmin((double)(now_ns - frame->seen_ns) * 1e-9, frame->carry_s);
	struct pose turn = pose_from_rotation_vector(vec3_scale(frame->turn_rate_rad_s, dt_s));
	struct pose turned = frame->rt_stage_frame;

	turned.t = (struct vec3){0, 0, 0};
	turned = pose_compose(&turn, &turned);
	turned.t = vec3_add(frame->rt_stage_frame.t, vec3_scale(frame->velocity_m_s, dt_s));
	return turned;
}

/* A head that was found in the last shot has markers that were seen once: where they go is not
 * known yet, but too few others would hold it. */
static bool all_may_hold(const struct tracker_state *state, int frame,
			 const struct predictions *predictions)
{
	const struct frame_state *f = &state->frames[frame];
	int recent = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		recent += state->labels[i].frame == frame && predictions->labels[i].recent;
	return predictions->fresh[frame] || recent < AGREE_MIN;
}

/* Nearest point to each predicted marker, each point taken only by the marker nearest to it. */
static void pair_up(const struct tracker_state *state, int frame,
		    const struct predictions *predictions, const struct nearby *nearby,
		    const struct pose *pose, int16_t *entry_of_label)
{
	const struct frame_state *f = &state->frames[frame];
	double taken_m2[POINT_MAX];
	int16_t taken_by[POINT_MAX];
	bool all = all_may_hold(state, frame, predictions);

	for (int k = 0; k < nearby->count; k++)
		taken_by[k] = LABEL_NONE;
	for (int i = f->label_first; i < f->label_end; i++) {
		const struct prediction *p = &predictions->labels[i];
		double distance2_m2;

		entry_of_label[i] = -1;
		if (state->labels[i].frame != frame || (!all && !p->recent))
			continue;
		int best = nearby_nearest(nearby, pose_apply(pose, p->local_m),
					  NEAR_M[state->labels[i].kind], &distance2_m2);
		if (best < 0 || (taken_by[best] >= 0 && distance2_m2 >= taken_m2[best]))
			continue;
		if (taken_by[best] >= 0)
			entry_of_label[taken_by[best]] = -1;
		taken_m2[best] = distance2_m2;
		taken_by[best] = (int16_t)i;
		entry_of_label[i] = (int16_t)best;
	}
}

struct fit_pairs {
	int count, rigid_count;
	struct rigid_pair pairs[LABEL_MAX];
	uint8_t kind[LABEL_MAX]; /* enum label_kind */
	double sigma_m[LABEL_MAX];
};

static void add_pair(struct fit_pairs *fit, uint8_t kind, double sigma_m, struct vec3 from_m,
		     struct vec3 to_m)
{
	fit->kind[fit->count] = kind;
	fit->sigma_m[fit->count] = sigma_m;
	fit->pairs[fit->count++] = (struct rigid_pair){from_m, to_m, 1};
}

/* Starting from `pose`, rounds of weighting by the error and fitting. */
static bool fit_robustly(struct fit_pairs *fit, struct pose *pose)
{
	int agree = 0;

	for (int round = 0; round < ROUNDS; round++) {
		agree = 0;
		for (int i = 0; i < fit->count; i++) {
			double sigma_m = fit->sigma_m[i];
			double robust_m = ROBUST_M[fit->kind[i]];
			double scale_m = 2 * sigma_m > robust_m ? 2 * sigma_m : robust_m;
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
static bool is_convincing(const struct tracker_state *state, int frame,
			  const struct predictions *predictions, const struct fit_pairs *fit,
			  const struct pose *pose)
{
	const struct frame_state *f = &state->frames[frame];
	int close = 0, rigid_close = 0, rigid_recent = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		rigid_recent +=
			state->labels[i].kind == LABEL_SKULL && predictions->labels[i].recent;
	for (int i = 0; i < fit->count; i++) {
		bool is_close = rigid_error(&fit->pairs[i], pose) < CLOSE_M[fit->kind[i]];

		close += is_close;
		rigid_close += is_close && fit->kind[i] == LABEL_SKULL;
	}
	double share = (double)close / fit->count;

	if (close < AGREE_MIN || share < CLOSE_SHARE)
		return false;
	return rigid_recent < 3 || rigid_close >= 2 || share >= CLOSE_SHARE_ALONE;
}

static void collect_near(const struct tracker_state *state, int frame,
			 const struct predictions *predictions, const struct nearby *nearby,
			 const struct pose *pose, struct fit_pairs *fit)
{
	const struct frame_state *f = &state->frames[frame];
	int16_t entry_of_label[LABEL_MAX];

	fit->count = fit->rigid_count = 0;
	pair_up(state, frame, predictions, nearby, pose, entry_of_label);
	for (int i = f->label_first; i < f->label_end; i++)
		if (entry_of_label[i] >= 0)
			add_pair(fit, state->labels[i].kind, FIRST_SIGMA_M[state->labels[i].kind],
				 predictions->labels[i].local_m,
				 nearby->p_stage_m[entry_of_label[i]]);
}

bool head_refine(const struct tracker_state *state, int frame,
		 const struct predictions *predictions, const struct nearby *nearby,
		 struct pose *pose)
{
	struct pose refined = *pose;
	struct fit_pairs fit;

	for (int again = 0; again < 2; again++) {
		struct pose before = refined;

		collect_near(state, frame, predictions, nearby, &refined, &fit);
		if (fit.count < AGREE_MIN || !fit_robustly(&fit, &refined))
			return false;
		if (head_distance_m(&before, &refined) < SETTLED_M)
			break;
	}
	if (!is_convincing(state, frame, predictions, &fit, &refined))
		return false;
	*pose = refined;
	return true;
}

/* How far a marker may be from where its frame has it. Skin moves together: many markers of it are
 * worth a few. */
static double still_m(const struct label_state *label)
{
	if (label->kind == LABEL_SKIN)
		return SKIN_SHARED * (sqrt(label->rest_variance_m2) + REST_SIGMA_MIN_M);
	return label->kind == LABEL_SKULL ? RIGID_SIGMA_M : BODY_SIGMA_M;
}

static void collect_named(const struct tracker_state *state, int frame, const struct point *points,
			  const int16_t *point_of_label, struct fit_pairs *fit)
{
	const struct frame_state *f = &state->frames[frame];

	fit->count = fit->rigid_count = 0;
	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		if (label->frame != frame || point_of_label[i] < 0)
			continue;
		const struct point *point = &points[point_of_label[i]];
		fit->rigid_count += label->kind != LABEL_SKIN;
		add_pair(fit, label->kind, hypot(still_m(label), fix_noise_m(&point->fix)),
			 label->kind == LABEL_SKIN ? label->rest_m : label->base_m,
			 point->fix.p_stage_m);
	}
}

/* Rms distance over the rigid markers, or over all where there are none. */
static double fit_residual_m(const struct fit_pairs *fit, const struct pose *pose)
{
	double sum_m2 = 0;
	int count = 0;

	for (int i = 0; i < fit->count; i++) {
		if (fit->kind[i] == LABEL_SKIN && fit->rigid_count > 0)
			continue;
		double error_m = rigid_error(&fit->pairs[i], pose);
		sum_m2 += error_m * error_m;
		count++;
	}
	return sqrt(sum_m2 / count);
}

void head_fit(const struct tracker_state *state, int frame, const struct point *points,
	      const int16_t *point_of_label, const struct pose *guess, struct head *out)
{
	struct fit_pairs fit;
	struct pose pose = *guess;

	out->valid = 0;
	collect_named(state, frame, points, point_of_label, &fit);
	if (fit.count < AGREE_MIN || !fit_robustly(&fit, &pose))
		return;
	out->valid = 1;
	out->rigid_count = (uint8_t)(fit.rigid_count > UINT8_MAX ? UINT8_MAX : fit.rigid_count);
	out->rt_stage_head = pose;
	out->residual_m = fit_residual_m(&fit, &pose);
}

void head_update(struct frame_state *frame, const struct pose *pose, int64_t now_ns)
{
	double dt_s = (double)(now_ns - frame->seen_ns) * 1e-9;

	frame->velocity_m_s = frame->turn_rate_rad_s = (struct vec3){0, 0, 0};
	if (frame->tracked && dt_s > 0 && dt_s <= GAP_MAX_S) {
		struct pose back = pose_inverse(&frame->rt_stage_frame);
		struct pose turn = pose_compose(pose, &back);

		frame->turn_rate_rad_s = vec3_scale(pose_to_rotation_vector(&turn), 1 / dt_s);
		frame->velocity_m_s =
			vec3_scale(vec3_sub(pose->t, frame->rt_stage_frame.t), 1 / dt_s);
	}
	frame->rt_stage_frame = *pose;
	frame->seen_ns = now_ns;
	frame->tracked = true;
}
