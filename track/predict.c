/*
 * Constant velocity for what was seen a moment ago; for the rest the displacement of the
 * neighbours, each weighted by how alike the two have moved so far.
 */
#include "track/predict.h"

#define RECENT_S 0.1           /* own motion is trusted this long */
#define EXTRAPOLATE_MAX_S 0.05 /* velocity is carried on this long */
#define ACCELERATION_M_S2 12.0 /* of skin against the skull, one sigma: 1 m/s at 4 Hz is 25 */
#define SIGMA_MIN_M 0.0004
#define SIGMA_MAX_M 0.010
#define FRESH_SIGMA_M 0.004 /* of a face against its neutral layout */
#define OFFSET_FADE_S 0.5   /* an own offset from the neighbours is forgotten */
#define PRIOR_SPREAD 0.2    /* of the distance between two neighbours */
#define SPREAD_MIN_M2 (0.0005 * 0.0005)
#define RISE_S 0.05
#define FALL_S 10.0
#define PRIOR_S 0.3 /* what the priors are worth */
#define REST_PRIOR_M2 (0.003 * 0.003)
#define NEIGHBOUR_DISTANCE_MAX_M 0.06

static void insert_neighbour(struct label_state *label, const double *distance_m, int16_t other)
{
	int place = label->neighbour_count;

	while (place > 0 && distance_m[label->neighbours[place - 1].label] > distance_m[other])
		place--;
	if (place == NEIGHBOUR_MAX)
		return;
	if (label->neighbour_count < NEIGHBOUR_MAX)
		label->neighbour_count++;
	for (int k = label->neighbour_count - 1; k > place; k--)
		label->neighbours[k] = label->neighbours[k - 1];
	double spread_m = PRIOR_SPREAD * distance_m[other];
	label->neighbours[place] = (struct neighbour){other, spread_m * spread_m + SPREAD_MIN_M2};
}

void predict_init(struct tracker_state *state, const struct layout *layout)
{
	double distance_m[LABEL_MAX];

	for (uint32_t i = 0; i < layout->marker_count; i++) {
		struct label_state *label = &state->labels[i];

		label->spacing_m = INFINITY;
		label->rest_m = layout->markers[i].neutral_m;
		label->rest_variance_m2 = REST_PRIOR_M2;
		for (uint32_t k = 0; k < layout->marker_count; k++) {
			distance_m[k] = vec3_distance(layout->markers[i].neutral_m,
						      layout->markers[k].neutral_m);
			if (k == i)
				continue;
			label->spacing_m = fmin(label->spacing_m, distance_m[k]);
			/* a rigid marker says nothing of skin, nor skin of it */
			if (!layout->markers[i].rigid && !layout->markers[k].rigid &&
			    distance_m[k] < NEIGHBOUR_DISTANCE_MAX_M)
				insert_neighbour(label, distance_m, (int16_t)k);
		}
	}
}

static struct prediction predict_recent(const struct label_state *label, bool rigid, double age_s)
{
	double carried_s = fmin(age_s, EXTRAPOLATE_MAX_S);
	double sigma_m =
		rigid ? SIGMA_MIN_M : SIGMA_MIN_M + 0.5 * ACCELERATION_M_S2 * age_s * age_s;

	return (struct prediction){
		rigid ? label->local_m
		      : vec3_add(label->local_m, vec3_scale(label->velocity_m_s, carried_s)),
		fmin(sigma_m, SIGMA_MAX_M), true};
}

void predict_motion(const struct tracker_state *state, const struct layout *layout, int64_t now_ns,
		    struct predictions *out)
{
	out->count = layout->marker_count;
	out->fresh_start = true;
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		const struct label_state *label = &state->labels[i];
		double age_s = (double)(now_ns - label->seen_ns) * 1e-9;

		if (label->confirmed && !label->doubted && age_s <= RECENT_S) {
			out->labels[i] = predict_recent(label, layout->markers[i].rigid, age_s);
			out->fresh_start = false;
		} else {
			struct vec3 local_m =
				label->confirmed ? label->filled_m : layout->markers[i].neutral_m;
			double sigma_m = layout->markers[i].rigid ? 2 * SIGMA_MIN_M : FRESH_SIGMA_M;

			out->labels[i] = (struct prediction){local_m, sigma_m, false};
		}
	}
}

int predict_displacement(const struct label_state *label, const struct layout *layout,
			 const bool *seen, const struct vec3 *seen_m, struct vec3 *displacement_m,
			 double *sigma_m)
{
	struct vec3 sum = {0, 0, 0};
	double weight = 0;
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		const struct neighbour *neighbour = &label->neighbours[k];

		if (!seen[neighbour->label])
			continue;
		double w = 1 / neighbour->spread_m2;
		struct vec3 moved = vec3_sub(seen_m[neighbour->label],
					     layout->markers[neighbour->label].neutral_m);
		sum = vec3_add(sum, vec3_scale(moved, w));
		weight += w;
		count++;
	}
	*displacement_m = count ? vec3_scale(sum, 1 / weight) : sum;
	/* Neighbours err together: the mean is as good as two of them, not as all. */
	*sigma_m = count ? fmin(sqrt(0.5 * count / weight), SIGMA_MAX_M) : SIGMA_MAX_M;
	return count;
}

/* How the neighbours differ from their own predictions says how this one will. */
static bool neighbours_shift(const struct label_state *label, const struct predictions *motion,
			     const bool *seen, const struct vec3 *seen_m, struct vec3 *shift_m)
{
	struct vec3 sum = {0, 0, 0};
	double weight = 0;
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		int other = label->neighbours[k].label;

		if (!seen[other] || !motion->labels[other].recent)
			continue;
		double w = 1 / label->neighbours[k].spread_m2;
		sum = vec3_add(
			sum, vec3_scale(vec3_sub(seen_m[other], motion->labels[other].local_m), w));
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

	if (neighbours_shift(label, motion, seen, seen_m, &shift_m)) {
		own.local_m = vec3_add(own.local_m, shift_m);
		own.sigma_m = SIGMA_MIN_M + label->noise_m + 0.4 * own.sigma_m;
	}
	return own;
}

static struct prediction fill_stale(const struct label_state *label, const struct layout *layout,
				    uint32_t index, int64_t now_ns, const bool *seen,
				    const struct vec3 *seen_m)
{
	struct prediction filled = {.recent = false};
	struct vec3 moved_m;
	double fade = 0;

	predict_displacement(label, layout, seen, seen_m, &moved_m, &filled.sigma_m);
	if (label->confirmed)
		fade = exp(-(double)(now_ns - label->seen_ns) * 1e-9 / OFFSET_FADE_S);
	filled.local_m = vec3_add(vec3_add(layout->markers[index].neutral_m, moved_m),
				  vec3_scale(label->offset_m, fade));
	filled.sigma_m = fmax(filled.sigma_m, SIGMA_MIN_M);
	if (layout->markers[index].rigid)
		filled = (struct prediction){label->confirmed ? label->local_m
							      : layout->markers[index].neutral_m,
					     2 * SIGMA_MIN_M, false};
	return filled;
}

void predict_from_neighbours(const struct tracker_state *state, const struct layout *layout,
			     int64_t now_ns, const struct predictions *motion, const bool *seen,
			     const struct vec3 *seen_m, struct predictions *out)
{
	out->count = motion->count;
	out->fresh_start = motion->fresh_start;
	for (uint32_t i = 0; i < motion->count; i++) {
		const struct label_state *label = &state->labels[i];

		if (motion->labels[i].recent)
			out->labels[i] =
				refine_recent(label, motion, motion->labels[i], seen, seen_m);
		else
			out->labels[i] = fill_stale(label, layout, i, now_ns, seen, seen_m);
	}
}

/* A mean square that rises at once and falls slowly: a face at rest for a while must not make what
 * follows look impossible. At first the prior soon gives way. */
static void learn_mean(double *mean_m2, double now_m2, double dt_s, double learned_s)
{
	double time_s = now_m2 > *mean_m2 ? RISE_S : fmin(FALL_S, PRIOR_S + learned_s);

	*mean_m2 += (now_m2 - *mean_m2) * fmin(dt_s / time_s, 1);
}

static void learn_spread(struct label_state *label, const struct layout *layout, uint32_t i,
			 double dt_s, const bool *seen, const struct vec3 *seen_m)
{
	for (int k = 0; k < label->neighbour_count; k++) {
		int other = label->neighbours[k].label;

		if (!seen[other])
			continue;
		struct vec3 own = vec3_sub(seen_m[i], layout->markers[i].neutral_m);
		struct vec3 its = vec3_sub(seen_m[other], layout->markers[other].neutral_m);
		struct vec3 apart = vec3_sub(own, its);
		double *spread_m2 = &label->neighbours[k].spread_m2;
		double now_m2 = fmax(vec3_dot(apart, apart), SPREAD_MIN_M2);
		learn_mean(spread_m2, now_m2, dt_s, label->learned_s);
	}
}

static void learn_rest(struct label_state *label, double dt_s, struct vec3 seen_m)
{
	struct vec3 off = vec3_sub(seen_m, label->rest_m);
	double share = fmin(dt_s / fmin(FALL_S, PRIOR_S + label->learned_s), 1);

	learn_mean(&label->rest_variance_m2, vec3_dot(off, off), dt_s, label->learned_s);
	label->rest_m = vec3_add(label->rest_m, vec3_scale(off, share));
}

void predict_learn(struct tracker_state *state, const struct layout *layout, double dt_s,
		   bool anchored, const bool *seen, const struct vec3 *seen_m)
{
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		if (!seen[i] || layout->markers[i].rigid)
			continue;
		state->labels[i].learned_s += dt_s;
		learn_spread(&state->labels[i], layout, i, dt_s, seen, seen_m);
		if (anchored)
			learn_rest(&state->labels[i], dt_s, seen_m[i]);
	}
}
