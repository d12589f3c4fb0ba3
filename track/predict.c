/*
 * Constant velocity for what was seen a moment ago; for the rest the displacement of the
 * neighbours, each weighted by how alike the two have moved so far.
 */
#include "track/predict.h"

#include <assert.h>
#include <string.h>

#include "track/label/jaw.h"

#define HEAD_CARRY_S 0.1
#define SEGMENT_CARRY_S 0.03   /* it turns about a place far from its markers */
#define RECENT_S 0.1           /* own motion is trusted this long */
#define EXTRAPOLATE_MAX_S 0.05 /* velocity is carried on this long */
#define ACCELERATION_M_S2 12.0 /* of skin against the skull, one sigma: 1 m/s at 4 Hz is 25 */
#define SIGMA_MIN_M 0.0004
#define BODY_SIGMA_M 0.003 /* of a body marker against its segment */
#define SIGMA_MAX_M 0.010
#define FRESH_SIGMA_M 0.004 /* of a face against its neutral layout */
#define OFFSET_FADE_S 0.5   /* an own offset from the neighbours is forgotten */
#define SHIFT_SIGMA 1.5     /* a neighbour's own motion is at most so much vaguer */
#define PRIOR_SPREAD 0.2    /* of the distance between two neighbours */
#define SMALL_M2                                                                        \
	(0.005 * 0.005) /* of a displacement: what is left is no share of a smaller one \
			 */
#define SPREAD_MIN_M2 (0.0005 * 0.0005)
#define RISE_S 0.05
#define FALL_S 10.0
#define GAIN_PRIOR_M2                                                              \
	(0.003 * 0.003) /* in seconds of such a displacement: that both move alike \
			 */
#define GAIN_MAX 2.5
#define FAR_APART_NS 20000000
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
	label->neighbours[place] =
		(struct neighbour){.label = other,
				   .gain = 1,
				   .leaves = (spread_m * spread_m + SPREAD_MIN_M2) / SMALL_M2};
}

/* Two groups that differ in upper and lower alone: lips, or lids. They lie close and part. */
static bool groups_oppose(const char *a, const char *b)
{
	const char *upper = strstr(a, "upper"), *lower = strstr(b, "lower");

	return upper && lower && upper - a == lower - b &&
	       strncmp(a, b, (size_t)(upper - a)) == 0 && strcmp(upper + 5, lower + 5) == 0;
}

bool predict_opposes(const char *group, const char *other)
{
	return groups_oppose(group, other) || groups_oppose(other, group);
}

static bool may_speak_for(const struct tracker_state *state, const struct layout *layout,
			  uint32_t a, uint32_t b)
{
	const struct label_state *label = &state->labels[a], *other = &state->labels[b];
	const char *group = layout->markers[a].group, *its = layout->markers[b].group;

	/* a rigid marker says nothing of skin, nor skin of it */
	return a != b && label->frame == other->frame && label->kind == LABEL_SKIN &&
	       other->kind == LABEL_SKIN && !predict_opposes(group, its);
}

/* Keeps the nearest others of the frame, whatever they say of it. */
static void init_watch(struct tracker_state *state, struct label_state *label, uint32_t first,
		       uint32_t end)
{
	for (int k = 0; k < WATCH_MAX; k++)
		label->watch[k] = LABEL_NONE;
	for (uint32_t i = first; i < end; i++) {
		const struct label_state *other = &state->labels[i];
		int16_t moving = (int16_t)i;

		if (other == label || other->frame != label->frame)
			continue;
		for (int k = 0; k < WATCH_MAX; k++) {
			int16_t held = label->watch[k];

			if (held >= 0 &&
			    vec3_distance(label->master_m, state->labels[held].master_m) <=
				    vec3_distance(label->master_m, state->labels[moving].master_m))
				continue;
			label->watch[k] = moving;
			if (held < 0)
				break;
			moving = held;
		}
	}
}

/* The nearest one across on the lower lip or lid. */
static int16_t find_below(const struct layout *layout, const struct layout_actor *actor, uint32_t i)
{
	const struct layout_marker *own = &layout->markers[i];
	int16_t below = LABEL_NONE;
	double least_m = INFINITY;

	for (uint32_t k = actor->first; k < actor->first + actor->count; k++) {
		const struct layout_marker *other = &layout->markers[k];
		double distance_m = vec3_distance(own->neutral_m, other->neutral_m);

		if (distance_m >= least_m || !groups_oppose(own->group, other->group) ||
		    own->neutral_m.y <= other->neutral_m.y)
			continue;
		least_m = distance_m;
		below = (int16_t)k;
	}
	return below;
}

static void init_neighbours(struct tracker_state *state, const struct layout *layout, uint32_t i)
{
	const struct layout_actor *actor = &layout->actors[state->labels[i].actor];
	struct label_state *label = &state->labels[i];
	double distance_m[LABEL_MAX];

	label->below = find_below(layout, actor, i);
	label->spacing_m = INFINITY;
	for (uint32_t k = actor->first; k < actor->first + actor->count; k++) {
		distance_m[k] =
			vec3_distance(layout->markers[i].neutral_m, layout->markers[k].neutral_m);
		if (k != i)
			label->spacing_m = fmin(label->spacing_m, distance_m[k]);
		if (may_speak_for(state, layout, i, k) && distance_m[k] < NEIGHBOUR_DISTANCE_MAX_M)
			insert_neighbour(label, distance_m, (int16_t)k);
	}
}

/* The segment's frame, a new one for the first marker that names it. */
static int16_t frame_of(struct tracker_state *state, const struct layout *layout, uint32_t i)
{
	int16_t actor = state->labels[i].actor;

	if (!layout->markers[i].segment[0])
		return actor;
	for (uint32_t k = layout->actors[actor].first; k < i; k++)
		if (strcmp(layout->markers[k].segment, layout->markers[i].segment) == 0)
			return state->labels[k].frame;
	assert(state->frame_count < FRAME_MAX);
	state->frames[state->frame_count].actor = actor;
	state->frames[state->frame_count].carry_s = SEGMENT_CARRY_S;
	return (int16_t)state->frame_count++;
}

static void init_label(struct tracker_state *state, const struct layout *layout, int16_t actor,
		       uint32_t i)
{
	const struct layout_marker *marker = &layout->markers[i];
	struct label_state *label = &state->labels[i];

	label->actor = actor;
	label->kind = marker->segment[0] ? LABEL_BODY : marker->rigid ? LABEL_SKULL : LABEL_SKIN;
	label->frame = frame_of(state, layout, i);
	label->master_m = label->base_m = label->rest_m = marker->neutral_m;
	label->rest_variance_m2 = REST_PRIOR_M2;
	label->diameter_m = marker->diameter_m;
	state->diameter_min_m = fmin(i ? state->diameter_min_m : INFINITY, label->diameter_m);
	state->diameter_max_m = fmax(state->diameter_max_m, label->diameter_m);
	struct frame_state *frame = &state->frames[label->frame];
	if (frame->label_count++ == 0)
		frame->label_first = (uint16_t)i;
	frame->label_end = (uint16_t)(i + 1);
}

void predict_init(struct tracker_state *state, const struct layout *layout)
{
	state->label_count = layout->marker_count;
	state->actor_count = state->frame_count = layout->actor_count;
	for (uint32_t a = 0; a < layout->actor_count; a++) {
		const struct layout_actor *actor = &layout->actors[a];

		state->frames[a].actor = (int16_t)a;
		state->frames[a].carry_s = HEAD_CARRY_S;
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_label(state, layout, (int16_t)a, i);
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_neighbours(state, layout, i);
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_watch(state, &state->labels[i], actor->first,
				   actor->first + actor->count);
		jaw_init(state, layout, (int)a);
		expression_init(state, (int)a);
	}
}

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

/* Where the whole face tells better than that, it does. */
static void take_better(const struct told *told, struct prediction *p)
{
	if (told->known && told->sigma_m < p->sigma_m) {
		p->local_m = told->local_m;
		p->sigma_m = told->sigma_m;
	}
}

void predict_from_face(const struct predictions *motion, const struct told *told,
		       struct predictions *out)
{
	*out = *motion;
	for (uint32_t i = 0; i < motion->count; i++)
		take_better(&told[i], &out->labels[i]);
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
	take_better(told, &filled);
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
			if (told[i].known)
				take_better(&told[i], &out->labels[i]);
		} else {
			out->labels[i] = fill_stale(state, label, now_ns, seen, seen_m, &told[i]);
		}
	}
}

/* Shares of what is new in what is learned. A mean square rises at once and falls slowly: a face at
 * rest for a while must not make what follows look impossible. At first the prior soon gives way.
 */
struct pace {
	double dt_s, rise, fall;
	double kept; /* of a sum that fades */
};

static struct pace pace_of(const struct label_state *label, double dt_s)
{
	return (struct pace){dt_s, fmin(dt_s / RISE_S, 1),
			     fmin(dt_s / fmin(FALL_S, PRIOR_S + label->learned_s), 1),
			     1 - fmin(dt_s / FALL_S, 1)};
}

static void learn_mean(double *mean, double now, struct pace pace)
{
	*mean += (now - *mean) * (now > *mean ? pace.rise : pace.fall);
}

/* Least squares through the origin, in which what was long ago fades. */
static void learn_gain(struct neighbour *neighbour, struct vec3 own, struct vec3 its,
		       struct pace pace)
{
	neighbour->both_m2 = pace.kept * neighbour->both_m2 + pace.dt_s * vec3_dot(own, its);
	neighbour->its_m2 = pace.kept * neighbour->its_m2 + pace.dt_s * vec3_dot(its, its);
	double gain = (neighbour->both_m2 + GAIN_PRIOR_M2) / (neighbour->its_m2 + GAIN_PRIOR_M2);
	neighbour->gain = gain > 0 ? gain < GAIN_MAX ? gain : GAIN_MAX : 0;
}

static void learn_spread(struct label_state *label, struct vec3 own, struct pace pace,
			 const bool *seen, const struct vec3 *moved_m)
{
	for (int k = 0; k < label->neighbour_count; k++) {
		struct neighbour *neighbour = &label->neighbours[k];

		if (!seen[neighbour->label])
			continue;
		struct vec3 its = moved_m[neighbour->label];
		struct vec3 apart = vec3_sub(own, vec3_scale(its, neighbour->gain));
		double left_m2 = vec3_dot(apart, apart);
		left_m2 = left_m2 > SPREAD_MIN_M2 ? left_m2 : SPREAD_MIN_M2;
		learn_mean(&neighbour->leaves, left_m2 / (vec3_dot(its, its) + SMALL_M2), pace);
		learn_gain(neighbour, own, its, pace);
	}
}

static void learn_rest(struct label_state *label, struct pace pace, struct vec3 seen_m)
{
	struct vec3 off = vec3_sub(seen_m, label->rest_m);

	learn_mean(&label->rest_variance_m2, vec3_dot(off, off), pace);
	label->rest_m = vec3_add(label->rest_m, vec3_scale(off, pace.fall));
}

void predict_learn(struct tracker_state *state, double dt_s, const bool *anchored, const bool *seen,
		   const struct vec3 *seen_m)
{
	struct vec3 moved_m[LABEL_MAX];

	for (uint32_t i = 0; i < state->label_count; i++)
		if (seen[i])
			moved_m[i] = vec3_sub(seen_m[i], state->labels[i].base_m);
	for (uint32_t i = 0; i < state->label_count; i++) {
		struct label_state *label = &state->labels[i];

		if (!seen[i] || label->kind != LABEL_SKIN)
			continue;
		label->learned_s += dt_s;
		struct pace pace = pace_of(label, dt_s);
		learn_spread(label, moved_m[i], pace, seen, moved_m);
		if (anchored[label->actor] && state->faces[label->actor].slipping_s == 0)
			learn_rest(label, pace, seen_m[i]);
	}
}
