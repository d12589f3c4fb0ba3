/*
 * Skin: its own motion from its last sight, what its neighbours tell, and where it rests, each by
 * its variance; the error of that mean is learned by the time since the last sight. A limb: it
 * turns about the markers of it that are seen.
 */
#include "track/fill.h"

#include <stddef.h>

#define TRIAL_S 0.6        /* as if lost for so long, then anew */
#define CARRIED_MAX_S 0.05 /* velocity is carried on this long */
#define OWN_MOTION_S 0.1   /* ... and tells nothing after this */
#define START_SIGMA_M 0.0003
#define ACCELERATION_M_S2 12.0
#define OFFSET_FADE_S 0.5   /* an own offset from the neighbours is forgotten */
#define OFFSET_HOLDS_S 0.15 /* ... and as much better than none for so long */
#define RISE_SHARE 0.15     /* of what an error is above what was thought, in one shot ... */
#define FALL_SHARE 0.01     /* ... and below */
#define RATIO_MIN 0.5       /* what is lost does worse than what is only held to be */
#define UNKNOWN_RATIO 2.0   /* of a marker that was seldom seen so far, on top */
#define UNKNOWN_S 1.0
#define FACE_ERRS 1.3 /* what the patterns of a face do not tell, on top */
#define ABOUT_MIN 3
#define EXPECTED_SHARE 0.75 /* of the markers about it, by a camera that should see it */
#define HIDES_MAX_M 0.0025
#define HIDES_S 0.03
#define SIGMA_MAX_M 0.02

#define SKULL_SIGMA_M 0.0001       /* while others of it hold the head ... */
#define SKULL_LOOSE_SIGMA_M 0.0005 /* ... or skin does */
#define BODY_SIGMA_M 0.002
#define DRIFT_M_S 0.15 /* of a frame that is not seen, on top of its own motion */
#define TURN_RAD_S 0.8 /* of a limb about the markers that hold it */
#define TURN_MAX_RAD 0.7
#define LEVER_LOST_M 0.15 /* of a limb of which nothing is seen */

/* Upper ends of the times since the last sight. */
static const double AGE_S[FILL_AGES] = {0.0125, 0.03, 0.06, 0.1, 0.2, 0.5, INFINITY};

static int age_bin(double age_s)
{
	int bin = 0;

	while (age_s > AGE_S[bin])
		bin++;
	return bin;
}

struct mean {
	struct vec3 sum;
	double weight;
};

static void add(struct mean *mean, struct vec3 local_m, double variance_m2)
{
	mean->sum = vec3_add(mean->sum, vec3_scale(local_m, 1 / variance_m2));
	mean->weight += 1 / variance_m2;
}

static void add_own_motion(struct mean *mean, const struct last_sight *last, double age_s)
{
	double carried_s = fmin(age_s, CARRIED_MAX_S);
	double sigma_m = START_SIGMA_M + 0.5 * ACCELERATION_M_S2 * age_s * age_s;

	if (last->moving && age_s <= OWN_MOTION_S)
		add(mean, vec3_add(last->local_m, vec3_scale(last->velocity_m_s, carried_s)),
		    sigma_m * sigma_m);
}

static void add_neighbours(struct mean *mean, const struct last_sight *last, struct vec3 told_m,
			   double told_sigma_m, double age_s)
{
	double fade = exp(-age_s / OFFSET_FADE_S), holds = exp(-age_s / OFFSET_HOLDS_S);
	double variance_m2 = told_sigma_m * told_sigma_m * (1 - holds * holds);

	add(mean, vec3_add(told_m, vec3_scale(last->offset_m, fade)),
	    variance_m2 + START_SIGMA_M * START_SIGMA_M);
}

/* Where it rests tells little while its neighbours are far from where they rest. */
static void add_rest(struct mean *mean, const struct label_state *label, struct vec3 told_m,
		     double told_sigma_m)
{
	struct vec3 apart = vec3_sub(told_m, label->rest_m);
	double variance_m2 = label->rest_variance_m2 / 3;
	double more_m2 = vec3_dot(apart, apart) / 3 - told_sigma_m * told_sigma_m - variance_m2;

	add(mean, label->rest_m, variance_m2 + fmax(more_m2, 0));
}

/* The error is what the parts claim, times what was learned. */
static struct filled fill_skin(const struct label_state *label, struct vec3 told_m,
			       double told_sigma_m, double age_s)
{
	struct mean mean = {.weight = 0};

	add_own_motion(&mean, &label->last, age_s);
	add_neighbours(&mean, &label->last, told_m, told_sigma_m, age_s);
	add_rest(&mean, label, told_m, told_sigma_m);
	return (struct filled){vec3_scale(mean.sum, 1 / mean.weight), sqrt(1 / mean.weight)};
}

static double age_of(const struct label_state *label, int64_t now_ns)
{
	return label->last.ns ? (double)(now_ns - label->last.ns) * 1e-9 : INFINITY;
}

/* Rises fast and falls slowly: markers are lost where the face moves most, so that what they do the
 * rest of the time says too little. */
static void learn_ratio(struct label_state *label, const struct filled *told, struct vec3 seen_m,
			double age_s)
{
	struct vec3 off = vec3_sub(seen_m, told->local_m);
	double ratio = vec3_dot(off, off) / (3 * told->sigma_m * told->sigma_m);
	float *over1 = &label->fill_over1[age_bin(age_s)];
	double more = ratio - 1 - (double)*over1;

	*over1 += (float)(more * (more > 0 ? RISE_SHARE : FALL_SHARE));
}

static void begin_trial(struct label_state *label, int64_t seen_ns)
{
	label->last = (struct last_sight){.ns = seen_ns,
					  .moving = label->moving && !label->doubted,
					  .local_m = label->local_m,
					  .velocity_m_s = label->velocity_m_s,
					  .offset_m = label->offset_m};
}

/* A marker that three cameras see, as if it had been lost for a while. */
static void watch(struct label_state *label, struct vec3 seen_m, int64_t now_ns)
{
	double age_s = age_of(label, now_ns);

	if (age_s > 0 && age_s < INFINITY) {
		struct vec3 told_m = vec3_sub(seen_m, label->offset_m);
		struct filled told = fill_skin(label, told_m, label->told_sigma_m, age_s);

		learn_ratio(label, &told, seen_m, age_s);
	}
	if (age_s > TRIAL_S)
		begin_trial(label, now_ns);
}

void fill_learn(struct tracker_state *state, const struct labelling *l, const struct point *points,
		int64_t now_ns)
{
	for (uint32_t i = 0; i < state->label_count; i++) {
		struct label_state *label = &state->labels[i];
		const struct point *point = l->seen[i] ? &points[l->point_of_label[i]] : NULL;

		if (label->kind != LABEL_SKIN || label->seen_ns == 0)
			continue;
		if (label->seen_ns != now_ns && label->last.ns < label->seen_ns)
			begin_trial(label, label->seen_ns);
		else if (label->seen_ns == now_ns && point && point->fix.used_count >= 3)
			watch(label, l->seen_m[i], now_ns);
	}
}

static int add_mask(const struct labelling *l, const struct point *points, int label,
		    uint32_t *masks, int count)
{
	if (label < 0 || !l->seen[label])
		return count;
	masks[count] = points[l->point_of_label[label]].fix.used_mask;
	return count + 1;
}

/* Whether three cameras see most of the markers about it. */
static bool is_expected(const struct labelling *l, const struct point *points,
			const struct label_state *label)
{
	uint32_t masks[WATCH_MAX + NEIGHBOUR_MAX];
	int count = 0, cameras = 0;

	for (int k = 0; k < WATCH_MAX; k++)
		count = add_mask(l, points, label->watch[k], masks, count);
	for (int k = 0; k < label->neighbour_count; k++)
		count = add_mask(l, points, label->neighbours[k].label, masks, count);
	for (int c = 0; c < CAMERA_MAX && count >= ABOUT_MIN; c++) {
		int see_it = 0;

		for (int k = 0; k < count; k++)
			see_it += masks[k] >> c & 1;
		cameras += see_it >= EXPECTED_SHARE * count;
	}
	return cameras >= 3;
}

/* A marker that the cameras about it should see, and do not, went where they cannot: into a fold or
 * under a lid, as far as it moves at all. */
static double hidden_variance_m2(const struct label_state *label, double age_s)
{
	return fmin(label->rest_variance_m2 / 3, HIDES_MAX_M * HIDES_MAX_M) *
	       fmin(age_s / HIDES_S, 1);
}

/* Where the whole face tells better, it does. */
static double take_face(const struct told *told, double variance_m2, struct filled *filled)
{
	double its_m2 = FACE_ERRS * FACE_ERRS * told->sigma_m * told->sigma_m;

	if (!told->known || its_m2 >= variance_m2)
		return variance_m2;
	filled->local_m = told->local_m;
	return its_m2;
}

static struct filled place_skin(const struct tracker_state *state, const struct labelling *l,
				const struct point *points, uint32_t i, int64_t now_ns)
{
	const struct label_state *label = &state->labels[i];
	double age_s = age_of(label, now_ns), sigma_m;
	struct vec3 told_m;

	predict_told(state, label, l->seen, l->seen_m, &told_m, &sigma_m);
	struct filled filled = fill_skin(label, told_m, sigma_m, age_s);
	double ratio = fmax(1 + (double)label->fill_over1[age_bin(age_s)], RATIO_MIN);
	ratio += UNKNOWN_RATIO * exp(-label->learned_s / UNKNOWN_S);
	double variance_m2 = ratio * filled.sigma_m * filled.sigma_m;
	variance_m2 = take_face(&l->told[i], variance_m2, &filled);
	if (label->absent_s > 0 || is_expected(l, points, label))
		variance_m2 += hidden_variance_m2(label, age_s);
	filled.sigma_m = fmin(fmax(sqrt(variance_m2), START_SIGMA_M), SIGMA_MAX_M);
	return filled;
}

/* How far the label is from what its seen fellows hold: a point, a line, or nothing of its own. */
static double lever_m(const struct tracker_state *state, const struct labelling *l, uint32_t label)
{
	const struct frame_state *f = &state->frames[state->labels[label].frame];
	struct vec3 held_m[2], base_m = state->labels[label].base_m;
	int count = 0;

	for (uint32_t i = f->label_first; i < f->label_end; i++) {
		if (state->labels[i].frame != state->labels[label].frame || !l->seen[i])
			continue;
		if (count == 2)
			return 0;
		held_m[count++] = state->labels[i].base_m;
	}
	if (count == 0)
		return LEVER_LOST_M;
	struct vec3 from = vec3_sub(base_m, held_m[0]);
	if (count == 1)
		return vec3_norm(from);
	return vec3_norm(vec3_cross(from, vec3_unit(vec3_sub(held_m[1], held_m[0]))));
}

static struct filled place_body(const struct tracker_state *state, const struct labelling *l,
				uint32_t i, int64_t now_ns)
{
	const struct label_state *label = &state->labels[i];
	double loose_s = (double)(now_ns - state->frames[label->frame].held_ns) * 1e-9;
	double turned_m = lever_m(state, l, i) * fmin(TURN_RAD_S * loose_s, TURN_MAX_RAD);

	return (struct filled){label->base_m, hypot(BODY_SIGMA_M, turned_m)};
}

struct filled fill_place(const struct tracker_state *state, const struct labelling *l,
			 const struct point *points, uint32_t i, int64_t now_ns)
{
	const struct label_state *label = &state->labels[i];
	const struct frame_state *frame = &state->frames[label->frame];
	struct filled filled;

	if (label->kind == LABEL_SKIN)
		filled = place_skin(state, l, points, i, now_ns);
	else if (label->kind == LABEL_BODY)
		filled = place_body(state, l, i, now_ns);
	else
		filled = (struct filled){label->local_m, frame->held_ns == now_ns
								 ? SKULL_SIGMA_M
								 : SKULL_LOOSE_SIGMA_M};
	filled.sigma_m += DRIFT_M_S * (double)(now_ns - frame->seen_ns) * 1e-9;
	return filled;
}
