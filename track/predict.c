/*
 * Constant velocity for what was seen a moment ago; for the rest the displacement of the
 * neighbours, each weighted by how alike the two have moved so far.
 */
#include "track/predict.h"

#include <string.h>

#include "track/predict_parts.h"

#define RECENT_S 0.1           /* own motion is trusted this long */
#define EXTRAPOLATE_MAX_S 0.05 /* velocity is carried on this long */
#define ACCELERATION_M_S2 12.0 /* of skin against the skull, one sigma: 1 m/s at 4 Hz is 25 */
#define SIGMA_MIN_M 0.0004
#define BODY_SIGMA_M 0.003 /* of a body marker against its segment */
#define SIGMA_MAX_M 0.010
#define FRESH_SIGMA_M 0.004 /* of a face against its neutral layout */
#define OFFSET_FADE_S 0.5   /* an own offset from the neighbours is forgotten */
#define SHIFT_SIGMA 1.5     /* a neighbour's own motion is at most so much vaguer */
#define FAR_APART_NS 20000000

bool predict_far_apart(const struct tracker_state *state)
{
	return state->period_ns > FAR_APART_NS;
}

static const double STIFF_SIGMA_M[] = {
	[LABEL_SKULL] = SIGMA_MIN_M,
	[LABEL_BODY] = BODY_SIGMA_M,
};

static struct prediction predict_recent(const struct label_state *label, double age_s)
{
	double carried_s = fmin(age_s, EXTRAPOLATE_MAX_S);

	if (label->kind != LABEL_SKIN)
		return (struct prediction){label->kind == LABEL_BODY ? label->base_m
								     : label->local_m,
					   STIFF_SIGMA_M[label->kind], true};
	return (struct prediction){
		vec3_add(label->local_m, vec3_scale(label->velocity_m_s, carried_s)),
		fmin(SIGMA_MIN_M + 0.5 * ACCELERATION_M_S2 * age_s * age_s, SIGMA_MAX_M), true};
}

/* Where it was when it was last known, else where the layout has it. */
static struct prediction predict_stale(const struct label_state *label)
{
	if (label->kind != LABEL_SKIN)
		return (struct prediction){label->confirmed && label->kind == LABEL_SKULL
						   ? label->local_m
						   : label->base_m,
					   2 * STIFF_SIGMA_M[label->kind], false};
	return (struct prediction){label->confirmed ? label->filled_m : label->base_m,
				   FRESH_SIGMA_M, false};
}

void predict_motion(const struct tracker_state *state, int64_t now_ns, struct predictions *out)
{
	out->count = state->label_count;
	for (uint32_t f = 0; f < state->frame_count; f++)
		out->fresh[f] = true;
	for (uint32_t i = 0; i < state->label_count; i++) {
		const struct label_state *label = &state->labels[i];
		double age_s = (double)(now_ns - label->seen_ns) * 1e-9;

		bool recent = label->confirmed && !label->doubted && age_s <= RECENT_S;

		/* without a velocity its neighbours know better where it goes */
		out->labels[i] = recent && (label->moving || label->kind != LABEL_SKIN)
					 ? predict_recent(label, age_s)
					 : predict_stale(label);
		if (recent)
			out->fresh[label->frame] = false;
	}
}

static double spread_m2(const struct neighbour *neighbour, struct vec3 its)
{
	double spread = neighbour->leaves * (vec3_dot(its, its) + SMALL_M2);

	return spread > SPREAD_MIN_M2 ? spread : SPREAD_MIN_M2; /* fmax() would be called */
}

int predict_told(const struct tracker_state *state, const struct label_state *label,
		 const bool *seen, const struct vec3 *seen_m, struct vec3 *told_m, double *sigma_m)
{
	struct vec3 sum = {0, 0, 0};
	double weight = 0, weight2 = 0;
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		const struct neighbour *neighbour = &label->neighbours[k];

		if (!seen[neighbour->label])
			continue;
		const struct label_state *its = &state->labels[neighbour->label];
		struct vec3 moved =
			vec3_sub(seen_m[neighbour->label], vec3_add(its->base_m, its->lean_m));
		double w = 1 / spread_m2(neighbour, moved);
		sum = vec3_add(sum, vec3_scale(moved, w * neighbour->gain));
		weight += w;
		weight2 += w * w;
		count++;
	}
	*told_m = vec3_add(vec3_add(label->base_m, label->lean_m),
			   count ? vec3_scale(sum, 1 / weight) : sum);
	/* Neighbours err together: the mean is as good as two of those that count, not as all. */
	*sigma_m =
		count ? fmin(sqrt(fmax(0.5 * weight / weight2 * weight, 1) / weight), SIGMA_MAX_M)
		      : SIGMA_MAX_M;
	return count;
}

/* How the neighbours differ from their own predictions says how this one will, if those are as
 * old: one that is only just back differs by what it did meanwhile. */
static bool neighbours_shift(const struct label_state *label, const struct predictions *motion,
			     struct prediction own, const bool *seen, const struct vec3 *seen_m,
			     struct vec3 *shift_m)
{
	struct vec3 sum = {0, 0, 0};
	double weight = 0;
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		int other = label->neighbours[k].label;

		if (!seen[other] || !motion->labels[other].recent ||
		    motion->labels[other].sigma_m > SHIFT_SIGMA * own.sigma_m ||
		    own.sigma_m > SHIFT_SIGMA * motion->labels[other].sigma_m)
			continue;
		double w = 1 / label->neighbours[k].leaves;
		struct vec3 moved = vec3_sub(seen_m[other], motion->labels[other].local_m);
		sum = vec3_add(sum, vec3_scale(moved, w * label->neighbours[k].gain));
		weight += w;
		count++;
	}
	if (count < 3)
		return false;
	*shift_m = vec3_scale(sum, 1 / weight);
	return true;
}

static struct prediction refine_recent(const struct label_state *label,
				       const struct predictions *motion, struct prediction own,
				       const bool *seen, const struct vec3 *seen_m)
{
	struct vec3 shift_m;

	if (neighbours_shift(label, motion, own, seen, seen_m, &shift_m)) {
		own.local_m = vec3_add(own.local_m, shift_m);
		own.sigma_m = SIGMA_MIN_M + label->noise_m + 0.4 * own.sigma_m;
	}
	return own;
}

void predict_from_face(const struct predictions *motion, const struct told *told,
		       struct predictions *out)
{
	*out = *motion;
	for (uint32_t i = 0; i < motion->count; i++)
		told_if_surer(&told[i], &out->labels[i].local_m, &out->labels[i].sigma_m);
}

/* Who contradict each other by more than they claim both err, as much more (Birge 1932). */
static void contradict(struct told *told, struct prediction *p)
{
	struct vec3 apart = vec3_sub(told->local_m, p->local_m);
	double claim2_m2 = told->sigma_m * told->sigma_m + p->sigma_m * p->sigma_m;
	double over = told->known ? vec3_dot(apart, apart) / claim2_m2 : 0;

	if (over <= 1)
		return;
	told->sigma_m *= sqrt(over);
	p->sigma_m *= sqrt(over);
}

static struct prediction fill_stale(const struct tracker_state *state,
				    const struct label_state *label, int64_t now_ns,
				    const bool *seen, const struct vec3 *seen_m,
				    const struct told *told)
{
	struct prediction filled = {.recent = false};
	double fade = 0;

	if (label->kind != LABEL_SKIN)
		return predict_stale(label);
	predict_told(state, label, seen, seen_m, &filled.local_m, &filled.sigma_m);
	if (label->confirmed)
		fade = exp(-(double)(now_ns - label->seen_ns) * 1e-9 / OFFSET_FADE_S);
	filled.local_m = vec3_add(filled.local_m, vec3_scale(label->offset_m, fade));
	struct told face = *told;
	contradict(&face, &filled);
	told_if_surer(&face, &filled.local_m, &filled.sigma_m);
	filled.sigma_m = fmax(filled.sigma_m, SIGMA_MIN_M);
	return filled;
}

/* Of one that was not seen in the last shot its neighbours may know better where it is. */
static void take_neighbours(const struct tracker_state *state, const struct label_state *label,
			    int64_t now_ns, const bool *seen, const struct vec3 *seen_m,
			    const struct told *told, struct prediction *p)
{
	struct prediction filled = fill_stale(state, label, now_ns, seen, seen_m, told);

	if (filled.sigma_m < p->sigma_m) {
		p->local_m = filled.local_m;
		p->sigma_m = filled.sigma_m;
	}
}

void predict_from_neighbours(const struct tracker_state *state, int64_t now_ns,
			     const struct predictions *motion, const bool *seen,
			     const struct vec3 *seen_m, const struct told *told,
			     struct predictions *out)
{
	out->count = motion->count;
	memcpy(out->fresh, motion->fresh, sizeof(out->fresh));
	for (uint32_t i = 0; i < motion->count; i++) {
		const struct label_state *label = &state->labels[i];

		if (motion->labels[i].recent) {
			out->labels[i] =
				refine_recent(label, motion, motion->labels[i], seen, seen_m);
			if (label->seen_ns != state->mid_exposure_ns && !predict_far_apart(state))
				take_neighbours(state, label, now_ns, seen, seen_m, &told[i],
						&out->labels[i]);
			told_if_surer(&told[i], &out->labels[i].local_m, &out->labels[i].sigma_m);
		} else {
			out->labels[i] = fill_stale(state, label, now_ns, seen, seen_m, &told[i]);
		}
	}
}
