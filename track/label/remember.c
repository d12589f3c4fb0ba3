/*
 * A name is given when it is clear or holds for a while, kept while its marker is followed, and
 * taken back when it goes against its neighbours for long.
 */
#include "track/label/remember.h"

#include "track/fill.h"
#include "track/label/first_names.h"
#include "track/label/wear.h"

#define STEADY_S 0.3       /* an unclear name is given when it holds this long */
#define STEADY_BODY_S 0.1  /* ... of a limb: what is not rigid soon falls out of its fit */
#define STEADY_ALONE_S 1.0 /* ... and this long where not all of its neighbours have names */
#define HELD_SHARE 0.5     /* of the distance to the next marker: where holding counts */
#define TRIED_SHARE 0.5    /* ... what goes so far meanwhile was put to the test */
#define REST_SHARE 0.3     /* ... and so near to where the neutral face has it nothing need be */
#define KNOWN_S 0.5        /* a name lost for less is not one from nothing */
#define AT_REST_M 0.002
#define AT_REST_SHARE 0.25  /* of the distance to the next marker */
#define STRANGE_MAX 12      /* shots against its neighbours, fewer of far ones, take a name back */
#define STRANGE_M 0.003     /* disagreement beyond this and a share of the spacing is strange */
#define LEARNED_AFTER_S 0.1 /* a younger name teaches nothing */
#define FOLLOW_ACCELERATION_M_S2 25.0
#define FOLLOW_GAP_MAX_S 0.05
#define JUMP_SHARE 0.5      /* of the distance to the next marker, in one shot */
#define FOLLOW_SIGMA 2.0    /* from where it is to the next marker, at least */
#define JUST_BACK_SHARE 0.2 /* ... of one that is only just back */
#define TWO_FAR_M 0.0015
#define FOLLOW_SHARE 0.4 /* of the distance to the next marker: no farther from where expected */
/* ... nor, of one that did not hold its name for long, from where its own motion carried it */
#define LEAP_SHARE 0.6

static void forget_label(struct label_state *label)
{
	label->confirmed = label->doubted = false;
	label->seen_ns = 0;
	label->steady_since_ns = 0;
}

void remember_nothing(struct tracker_state *state, int frame)
{
	for (uint32_t i = 0; i < state->label_count; i++)
		if (state->labels[i].frame == frame)
			forget_label(&state->labels[i]);
}

/* Where the neutral face has it, the jaw being closed. */
static bool is_at_rest(const struct labelling *l, const struct label_state *label, uint32_t i)
{
	return vec3_norm(label->lean_m) < AT_REST_M &&
	       vec3_distance(label->base_m, l->seen_m[i]) < AT_REST_SHARE * label->spacing_m;
}

/* For how long a label has had the point, not far from where it is expected: it may be a light
 * where the marker was, unless the face was just found and nothing else is left over. */
static double held_s(struct label_state *label, const struct labelling *l, uint32_t i,
		     enum reading reading, bool jumped, int64_t now_ns)
{
	bool may_be_far = !label->confirmed && reading == READING_WHOLE;

	if (jumped || label->steady_since_ns == 0) {
		label->steady_since_ns = now_ns;
		label->steady_from_m = l->seen_m[i];
		label->steady_way_m = 0;
	}
	label->steady_way_m =
		fmax(label->steady_way_m, vec3_distance(label->steady_from_m, l->seen_m[i]));
	double off_m = vec3_distance(l->predictions.labels[i].local_m, l->seen_m[i]);
	if (label->kind == LABEL_SKIN && !may_be_far && off_m > HELD_SHARE * label->spacing_m)
		return 0;
	return (double)(now_ns - label->steady_since_ns) * 1e-9;
}

/* Holding alone proves something if the marker moved meanwhile or is where the neutral face has it:
 * a face that is read aside and held still agrees with itself for ever. */
static bool is_tried(const struct labelling *l, const struct label_state *label, uint32_t i)
{
	return label->confirmed || label->steady_way_m > TRIED_SHARE * label->spacing_m ||
	       vec3_distance(label->base_m, l->seen_m[i]) < REST_SHARE * label->spacing_m;
}

/* A name is given at once where it is clear, else when it has held for a while; from nothing only
 * where the reading comes out even, or has held for long. A stray light beside a marker at rest,
 * and no label that could mean it, hints at nothing. */
static bool may_confirm(struct tracker_state *state, const struct labelling *l,
			const struct leftovers *leftovers, const struct point *point, uint32_t i,
			bool jumped, int64_t now_ns)
{
	struct label_state *label = &state->labels[i];
	bool seen_well = point->fix.used_count >= 3 || point->is_pressed;
	if (seen_well && !wear_is_gone(label) &&
	    (label_is_told(l, state, i) || (label->confirmed && label_is_anchored(l, state, i))))
		return true;
	enum reading reading = first_names_read(state, l, leftovers, i);
	bool rests = (reading <= READING_EVEN || leftovers->rests[label->actor]) &&
		     is_at_rest(l, label, i);
	bool clear = seen_well && !wear_is_gone(label) && label_is_clear(l, state, i) &&
		     (rests || label_is_alone(l, state, i));

	double steady_s = held_s(label, l, i, reading, jumped, now_ns);
	bool held_alone = steady_s > STEADY_ALONE_S && is_tried(l, label, i);
	if (label->kind == LABEL_SKIN && label_has_rival(l, state, i))
		return held_alone;
	if ((reading == READING_WHOLE || (rests && !label->confirmed)) && seen_well &&
	    !wear_is_gone(label) && label_is_plain(l, state, i))
		return true;
	bool known = label->confirmed && (double)(now_ns - label->seen_ns) * 1e-9 < KNOWN_S;
	if (label->kind != LABEL_SKIN || known || first_names_enclosed(state, l, leftovers, i))
		return clear || steady_s > (label->kind == LABEL_BODY ? STEADY_BODY_S : STEADY_S);
	if (clear &&
	    (reading <= READING_EVEN || (reading == READING_UNEVEN && is_at_rest(l, label, i))))
		return true;
	return reading != READING_SHIFTED && held_alone;
}

/* Where the neighbours tell that a label is. */
struct hearsay {
	int count; /* of those that tell */
	struct vec3 told_m;
	double sigma_m;
};

/* A name that goes against its neighbours for long was wrong from the start. */
static bool is_strange(struct label_state *label, const struct hearsay *hearsay, struct vec3 seen_m)
{
	if (label->kind != LABEL_SKIN || hearsay->count < 3)
		return false;
	double limit_m = STRANGE_M + 0.4 * label->spacing_m + 2 * hearsay->sigma_m;
	double off = vec3_distance(hearsay->told_m, seen_m) / limit_m;
	label->strange_count = off > 1 ? label->strange_count + (int)(off * off) : 0;
	return label->strange_count > STRANGE_MAX;
}

/* Velocity is followed as far as noise allows: the gain of a filter whose velocity changes by
 * acceleration times dt while its measurement has the noise of two places over dt. */
static void follow_velocity(struct label_state *label, struct vec3 local_m, double noise_m,
			    double dt_s)
{
	struct vec3 measured = vec3_scale(vec3_sub(local_m, label->local_m), 1 / dt_s);
	double change_m_s = FOLLOW_ACCELERATION_M_S2 * dt_s;
	double noise_m_s = hypot(noise_m, label->noise_m) / dt_s;
	double gain = label->moving ? change_m_s / (change_m_s + noise_m_s) : 1;
	struct vec3 off = vec3_sub(measured, label->velocity_m_s);

	label->velocity_m_s = vec3_add(label->velocity_m_s, vec3_scale(off, gain));
}

static bool was_just_seen(const struct label_state *label, int64_t now_ns)
{
	return label->confirmed && !label->doubted &&
	       (double)(now_ns - label->seen_ns) * 1e-9 < FOLLOW_GAP_MAX_S;
}

/* What is back moves as its neighbours do. False when too few of them are known to. */
static bool velocity_of_neighbours(const struct tracker_state *state,
				   const struct label_state *label, int64_t now_ns,
				   struct vec3 *velocity_m_s)
{
	struct vec3 sum = {0, 0, 0};
	double weight = 0;
	int count = 0;

	for (int k = 0; k < label->neighbour_count; k++) {
		const struct label_state *other = &state->labels[label->neighbours[k].label];

		if (!other->moving || !was_just_seen(other, now_ns))
			continue;
		double w = 1 / label->neighbours[k].leaves;
		sum = vec3_add(sum, vec3_scale(other->velocity_m_s, w * label->neighbours[k].gain));
		weight += w;
		count++;
	}
	*velocity_m_s = count >= 3 ? vec3_scale(sum, 1 / weight) : (struct vec3){0, 0, 0};
	return count >= 3;
}

/* A name that is given anew says nothing yet of how its marker moves. */
static void follow(const struct tracker_state *state, struct label_state *label,
		   struct vec3 local_m, double noise_m, bool anew, int64_t now_ns)
{
	double dt_s = (double)(now_ns - label->seen_ns) * 1e-9;

	if (!anew && dt_s > 0 && dt_s < FOLLOW_GAP_MAX_S) {
		follow_velocity(label, local_m, noise_m, dt_s);
		label->moving = true;
	} else {
		label->moving = velocity_of_neighbours(state, label, now_ns, &label->velocity_m_s);
	}
	label->local_m = local_m;
	label->noise_m = noise_m;
	label->seen_ns = now_ns;
	label->confirmed = true;
	label->doubted = false;
	label->steady_since_ns = 0;
}

/* Neighbours that are read wrongly may have it far from where it was a moment ago. A name that held
 * for a while is not one of those. */
static bool has_leapt(const struct tracker_state *state, const struct labelling *l, uint32_t i,
		      bool jumped)
{
	const struct label_state *label = &state->labels[i];
	const struct prediction *own = &l->motion.labels[i];

	if (label->named_s >= LABEL_HELD_S || predict_far_apart(state))
		return false;
	return own->recent
		       ? vec3_distance(own->local_m, l->seen_m[i]) > LEAP_SHARE * label->spacing_m
		       : jumped;
}

/* Most of those that see it did not a moment ago: a light may have come up beside the marker. */
static bool others_see(const struct label_state *label, const struct point *point)
{
	uint32_t mask = point->fix.used_mask;

	return label->kind == LABEL_SKIN &&
	       2 * __builtin_popcount(mask & label->camera_mask) < __builtin_popcount(mask);
}

/* A name that was not seen for a while, or where its marker was not expected, is given as a new one
 * is. Of one that is only just back, or that other cameras see now, the neighbours alone tell where
 * it is: it must lie nearer. */
static bool is_followed(const struct tracker_state *state, const struct labelling *l,
			const struct point *point, uint32_t i, bool jumped, int64_t now_ns)
{
	const struct label_state *label = &state->labels[i];
	const struct prediction *p = &l->predictions.labels[i];
	double off_m = vec3_distance(p->local_m, l->seen_m[i]);
	double share = p->recent && !others_see(label, point) ? FOLLOW_SHARE
		       : was_just_seen(label, now_ns)         ? JUST_BACK_SHARE
							      : 0;

	return label->confirmed && off_m < share * label->spacing_m &&
	       !has_leapt(state, l, i, jumped) &&
	       (label->kind != LABEL_SKIN || label->spacing_m - off_m > FOLLOW_SIGMA * p->sigma_m);
}

/* Two cameras may agree on something else: they regain nothing, and where shots are far apart they
 * hold only what is where the others have it. */
static bool two_may_follow(const struct tracker_state *state, const struct labelling *l, uint32_t i,
			   int64_t now_ns)
{
	return was_just_seen(&state->labels[i], now_ns) &&
	       (!predict_far_apart(state) ||
		vec3_distance(l->predictions.labels[i].local_m, l->seen_m[i]) < TWO_FAR_M);
}

/* Who sees it, and how far it is from where the neighbours tell, as far as that is known. */
static void note_sight(struct label_state *label, const struct point *point,
		       const struct hearsay *hearsay, struct vec3 seen_m)
{
	label->camera_mask = point->fix.used_mask;
	label->outvoted_mask = point->claimed_mask & ~point->fix.used_mask;
	if (point->fix.used_count < 3)
		return;
	label->told_sigma_m = hearsay->sigma_m;
	label->offset_m = vec3_sub(seen_m, hearsay->told_m);
}

static void update_label(struct tracker_state *state, const struct labelling *l,
			 const struct leftovers *leftovers, struct point *points, uint32_t i,
			 int64_t now_ns, double dt_s)
{
	struct label_state *label = &state->labels[i];
	int64_t last_ns = state->mid_exposure_ns; /* of the shot before */
	struct hearsay hearsay;

	/* What held so far was another point. */
	bool jumped = l->seen[i] && label->kind == LABEL_SKIN &&
		      vec3_distance(label->filled_m, l->seen_m[i]) > JUMP_SHARE * label->spacing_m;

	label->filled_m = l->seen[i] ? l->seen_m[i] : l->predictions.labels[i].local_m;
	label->doubted |= l->doubtful[i];
	if (!l->seen[i]) {
		label->steady_since_ns = 0;
		return;
	}
	hearsay.count =
		predict_told(state, label, l->seen, l->seen_m, &hearsay.told_m, &hearsay.sigma_m);
	if (is_strange(label, &hearsay, l->seen_m[i])) {
		label->confirmed = false;
		label->strange_count = 0;
		label->steady_since_ns = 0;
	}
	struct point *point = &points[l->point_of_label[i]];
	bool followed = is_followed(state, l, point, i, jumped, now_ns) &&
			(point->fix.used_count >= 3 || point->is_pressed ||
			 two_may_follow(state, l, i, now_ns));
	if (!followed && !may_confirm(state, l, leftovers, point, i, jumped, now_ns))
		return;
	note_sight(label, point, &hearsay, l->seen_m[i]);
	label->named_s = followed ? label->named_s + dt_s : 0;
	label->unbroken_s = followed && label->seen_ns == last_ns ? label->unbroken_s + dt_s : 0;
	follow(state, label, l->seen_m[i], fix_noise_m(&point->fix), !followed, now_ns);
	point->label = (int16_t)i;
}

/* Only what three cameras saw teaches anything. */
static void learn_motion(struct tracker_state *state, const struct labelling *l,
			 const struct point *points, const bool *anchored, int64_t now_ns,
			 double dt_s)
{
	bool sure[LABEL_MAX];

	for (uint32_t i = 0; i < state->label_count; i++)
		sure[i] = l->seen[i] && points[l->point_of_label[i]].fix.used_count >= 3;
	predict_learn(state, dt_s, anchored, sure, l->seen_m);
	for (uint32_t i = 0; i < state->label_count; i++)
		sure[i] = sure[i] && points[l->point_of_label[i]].label == (int16_t)i &&
			  state->labels[i].named_s > LEARNED_AFTER_S;
	for (uint32_t a = 0; a < state->actor_count; a++)
		if (l->found[a] && anchored[a])
			expression_learn(state, (int)a, &l->expressions[a], now_ns, dt_s, sure,
					 l->seen_m);
}

void remember_labels(struct labelling *l, struct tracker_state *state, struct point *points,
		     const bool *anchored, int64_t now_ns, double dt_s)
{
	struct leftovers leftovers;

	for (uint32_t f = 0; f < state->frame_count; f++)
		if (l->found[f])
			l->rt_frame_stage[f] = pose_inverse(&l->rt_stage_frame[f]);
	for (uint32_t i = 0; i < state->label_count; i++)
		if (l->seen[i])
			l->seen_m[i] = pose_apply(&l->rt_frame_stage[state->labels[i].frame],
						  points[l->point_of_label[i]].fix.p_stage_m);
	first_names_look(state, l, points, &leftovers);
	for (uint32_t i = 0; i < state->label_count; i++)
		if (l->found[state->labels[i].frame])
			update_label(state, l, &leftovers, points, i, now_ns, dt_s);
		else
			state->labels[i].steady_since_ns = 0;
	fill_learn(state, l, points, now_ns);
	learn_motion(state, l, points, anchored, now_ns, dt_s);
	wear_learn(state, l, points, anchored, dt_s);
}
