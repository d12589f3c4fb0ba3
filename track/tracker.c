/*
 * The order of work for one shot, and what is remembered for the next.
 */
#include "track/tracker.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "track/acquire.h"
#include "track/head.h"
#include "track/label.h"
#include "track/match.h"
#include "track/predict.h"

#define HEAD_KEPT_S 0.25 /* a head that is not measured for longer is looked for anew */
#define HEAD_GAP_S 0.05  /* ... and after a gap as long it must be found, not followed */
#define DOUBT_EVERY_SHOTS 10
#define DOUBT_M 0.006
#define SEED_RADIUS_M 0.004
#define STEADY_S 0.3    /* an unclear name is given when it holds this long */
#define STRANGE_MAX 12  /* shots in a row against the neighbours until a name is taken back */
#define STRANGE_M 0.003 /* disagreement beyond this and a share of the spacing is strange */
#define FOLLOW_ACCELERATION_M_S2 25.0
#define FOLLOW_GAP_MAX_S 0.05
#define EXCESS_MAX_PX2 (0.5 * 0.5)
#define EXCESS_GAIN 0.1         /* per shot */
#define EXCESS_CHI2_MAX 16.0    /* one point counts for no more */
#define TWO_CAMERA_MIN_M 0.0015 /* how far from its prediction a two-camera marker may be */
#define NEW_VIEW_M 0.0005       /* ... and where another camera joins in */
#define TWO_CAMERA_MAX_M 0.005
#define NAMED_SHARE_MIN 0.2 /* fewer names than this share of the points: the head is wrong */

struct tracker_scratch {
	struct matcher matcher;
	struct acquire_scratch acquire;
	struct labelling labelling;
	struct seed seeds[LABEL_MAX + LOOSE_MAX];
};

struct tracker_settings tracker_settings_default(void)
{
	return (struct tracker_settings){.match_gate_px = 1.0,
					 .calibration_sigma_px = 0.004,
					 .range_min_m = 0.1,
					 .range_max_m = 20};
}

int tracker_scratch_create(struct tracker_scratch **out)
{
	struct tracker_scratch *scratch = calloc(1, sizeof(*scratch));

	if (!scratch)
		return -ENOMEM;
	memset(scratch, 1, sizeof(*scratch)); /* touch every page now, not while live */
	memset(scratch, 0, sizeof(*scratch));
	*out = scratch;
	return 0;
}

void tracker_scratch_destroy(struct tracker_scratch *scratch)
{
	free(scratch);
}

void tracker_state_init(struct tracker_state *state, const struct layout *layout)
{
	memset(state, 0, sizeof(*state));
	state->label_count = layout->marker_count;
	predict_init(state, layout);
}

static void forget_names(struct tracker_state *state)
{
	for (uint32_t i = 0; i < state->label_count; i++) {
		state->labels[i].confirmed = state->labels[i].doubted = false;
		state->labels[i].seen_ns = 0;
		state->labels[i].steady_since_ns = 0;
	}
}

static void match_shot(struct tracker_state *state, struct tracker_scratch *scratch,
		       const struct pose *head)
{
	struct predictions *motion = &scratch->labelling.motion;
	int count = 0;

	for (uint32_t i = 0; state->head.tracked && i < motion->count; i++)
		scratch->seeds[count++] = (struct seed){
			pose_apply(head, motion->labels[i].local_m),
			fmin(SEED_RADIUS_M, 0.0005 + 1.2 * motion->labels[i].sigma_m)};
	for (uint32_t i = 0; i < state->loose_count; i++)
		scratch->seeds[count++] = (struct seed){state->loose_stage_m[i], SEED_RADIUS_M};
	match_seeds(&scratch->matcher, scratch->seeds, count);
	match_leftovers(&scratch->matcher);
}

static bool acquire(struct tracker_state *state, struct tracker_scratch *scratch,
		    const struct layout *layout, struct pose *head)
{
	const struct matcher *m = &scratch->matcher;

	return acquire_head(&scratch->acquire, layout, m->points, m->point_count,
			    &state->head.acquire_cursor, head) &&
	       head_refine(layout, &scratch->labelling.motion, m->points, m->point_count, head);
}

/* The head among this shot's points: near where it was a moment ago, else anywhere. After a gap its
 * old place is no guide: markers are alike, and a head found one marker aside looks well too. */
static bool find_head(struct tracker_state *state, struct tracker_scratch *scratch,
		      const struct layout *layout, int64_t now_ns, struct pose *head)
{
	const struct matcher *m = &scratch->matcher;
	double gap_s = (double)(now_ns - state->head.seen_ns) * 1e-9;

	if (state->head.tracked && gap_s <= HEAD_GAP_S &&
	    head_refine(layout, &scratch->labelling.motion, m->points, m->point_count, head))
		return true;
	return acquire(state, scratch, layout, head);
}

/* Skin alone holds the head: from time to time the whole stage is searched for a better place. */
static void doubt_head(struct tracker_state *state, struct tracker_scratch *scratch,
		       const struct layout *layout, const struct head *measured)
{
	struct pose other;

	if (measured->rigid_count >= 3) {
		state->head.unheld_count = 0;
		return;
	}
	if (++state->head.unheld_count % DOUBT_EVERY_SHOTS != 0 ||
	    !acquire(state, scratch, layout, &other))
		return;
	if (head_distance_m(&other, &measured->rt_stage_head) > DOUBT_M) {
		state->head.tracked = false;
		forget_names(state);
	}
}

/* Nothing but its neighbours can contradict a two-camera marker, and left alone it would drift off
 * with a wrong blob: it must stay where they tell, as it did when three cameras saw it. */
static bool two_camera_fits(const struct tracker_state *state, const struct labelling *l,
			    const struct layout *layout, uint32_t i, const struct point *point,
			    struct vec3 local_m)
{
	const struct label_state *label = &state->labels[i];
	struct vec3 moved_m;
	double sigma_m;

	if (layout->markers[i].rigid)
		return true;
	/* a camera that did not see it a moment ago must not pull it aside */
	double pull_m = vec3_distance(local_m, l->predictions.labels[i].local_m);
	if ((point->fix.used_mask & ~label->camera_mask) &&
	    pull_m > NEW_VIEW_M + 3 * fix_noise_m(&point->fix))
		return false;
	predict_displacement(label, layout, l->seen, l->seen_m, &moved_m, &sigma_m);
	struct vec3 told_m =
		vec3_add(vec3_add(layout->markers[i].neutral_m, moved_m), label->offset_m);
	if (label->rest_variance_m2 < sigma_m * sigma_m) {
		told_m = label->rest_m;
		sigma_m = sqrt(label->rest_variance_m2);
	}
	return vec3_distance(told_m, local_m) < TWO_CAMERA_MIN_M + 2.5 * sigma_m;
}

/* Labels without a point: is there one that only two cameras see? */
static void add_two_camera(struct tracker_state *state, struct tracker_scratch *scratch,
			   const struct layout *layout, const struct pose *head)
{
	struct labelling *l = &scratch->labelling;
	struct pose back = pose_inverse(head);

	for (uint32_t i = 0; i < state->label_count; i++) {
		const struct prediction *p = &l->predictions.labels[i];

		if (l->assign.column_of_row[i] != ASSIGN_NONE)
			continue;
		struct seed seed = {
			pose_apply(head, p->local_m),
			fmin(fmax(TWO_CAMERA_MIN_M, 2.5 * p->sigma_m),
			     fmin(TWO_CAMERA_MAX_M, 0.45 * state->labels[i].spacing_m))};
		int point = match_two_cameras(&scratch->matcher, &seed);
		if (point < 0)
			continue;
		const struct point *found = &scratch->matcher.points[point];
		struct vec3 local_m = pose_apply(&back, found->fix.p_stage_m);
		if (!two_camera_fits(state, l, layout, i, found, local_m))
			continue;
		l->point_of_label[i] = (int16_t)point;
		l->seen[i] = true;
		l->seen_m[i] = local_m;
	}
}

/* A name is given at once where it is clear, else when it has held for a while. */
static bool may_confirm(struct tracker_state *state, const struct tracker_scratch *scratch,
			const struct layout *layout, uint32_t i, int64_t now_ns)
{
	const struct labelling *l = &scratch->labelling;
	const struct point *point = &scratch->matcher.points[l->point_of_label[i]];
	struct label_state *label = &state->labels[i];

	if (label->steady_since_ns == 0)
		label->steady_since_ns = now_ns;
	if (point->fix.used_count >= 3 &&
	    label_is_clear(l, state, layout, (uint32_t)l->assign.column_count, i))
		return true;
	return (double)(now_ns - label->steady_since_ns) * 1e-9 > STEADY_S;
}

/* A name that goes against its neighbours for long was wrong from the start. */
static bool is_strange(struct label_state *label, const struct layout *layout,
		       const struct labelling *l, uint32_t i)
{
	struct vec3 moved_m;
	double sigma_m;

	if (layout->markers[i].rigid ||
	    predict_displacement(label, layout, l->seen, l->seen_m, &moved_m, &sigma_m) < 3)
		return false;
	struct vec3 told_m = vec3_add(layout->markers[i].neutral_m, moved_m);
	double limit_m = STRANGE_M + 0.4 * label->spacing_m + 2 * sigma_m;
	label->strange_count =
		vec3_distance(told_m, l->seen_m[i]) > limit_m ? label->strange_count + 1 : 0;
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
	double gain = change_m_s / (change_m_s + noise_m_s);
	struct vec3 off = vec3_sub(measured, label->velocity_m_s);

	label->velocity_m_s = vec3_add(label->velocity_m_s, vec3_scale(off, gain));
}

static void follow(struct label_state *label, struct vec3 local_m, double noise_m, int64_t now_ns)
{
	double dt_s = (double)(now_ns - label->seen_ns) * 1e-9;

	if (label->confirmed && dt_s > 0 && dt_s < FOLLOW_GAP_MAX_S)
		follow_velocity(label, local_m, noise_m, dt_s);
	else
		label->velocity_m_s = (struct vec3){0, 0, 0};
	label->local_m = local_m;
	label->noise_m = noise_m;
	label->seen_ns = now_ns;
	label->confirmed = true;
	label->doubted = false;
	label->steady_since_ns = 0;
}

static void update_label(struct tracker_state *state, struct tracker_scratch *scratch,
			 const struct layout *layout, uint32_t i, int64_t now_ns)
{
	struct labelling *l = &scratch->labelling;
	struct label_state *label = &state->labels[i];
	struct vec3 moved_m;
	double sigma_m;

	label->filled_m = l->seen[i] ? l->seen_m[i] : l->predictions.labels[i].local_m;
	label->doubted |= l->doubtful[i];
	if (!l->seen[i]) {
		label->steady_since_ns = 0;
		return;
	}
	if (is_strange(label, layout, l, i)) {
		label->confirmed = false;
		label->strange_count = 0;
		label->steady_since_ns = 0;
	}
	/* a name that was not seen for a while is given as a new one is */
	bool followed = label->confirmed && l->predictions.labels[i].recent;
	if (!followed && !may_confirm(state, scratch, layout, i, now_ns))
		return;
	struct point *point = &scratch->matcher.points[l->point_of_label[i]];
	if (point->fix.used_count >= 3) {
		predict_displacement(label, layout, l->seen, l->seen_m, &moved_m, &sigma_m);
		struct vec3 told_m = vec3_add(layout->markers[i].neutral_m, moved_m);
		label->offset_m = vec3_sub(l->seen_m[i], told_m);
	}
	follow(label, l->seen_m[i], fix_noise_m(&point->fix), now_ns);
	label->camera_mask = point->fix.used_mask;
	point->label = (int16_t)i;
}

/* Only what three cameras saw teaches anything. */
static void learn_motion(struct tracker_state *state, const struct tracker_scratch *scratch,
			 const struct layout *layout, bool anchored, double dt_s)
{
	const struct labelling *l = &scratch->labelling;
	bool sure[LABEL_MAX];

	for (uint32_t i = 0; i < state->label_count; i++)
		sure[i] = l->seen[i] &&
			  scratch->matcher.points[l->point_of_label[i]].fix.used_count >= 3;
	predict_learn(state, layout, dt_s, anchored, sure, l->seen_m);
}

static void update_labels(struct tracker_state *state, struct tracker_scratch *scratch,
			  const struct layout *layout, const struct head *measured, int64_t now_ns,
			  double dt_s)
{
	struct labelling *l = &scratch->labelling;
	struct pose back = pose_inverse(&measured->rt_stage_head);

	for (uint32_t i = 0; i < state->label_count; i++)
		if (l->seen[i])
			l->seen_m[i] = pose_apply(
				&back, scratch->matcher.points[l->point_of_label[i]].fix.p_stage_m);
	for (uint32_t i = 0; i < state->label_count; i++)
		update_label(state, scratch, layout, i, now_ns);
	learn_motion(state, scratch, layout, measured->rigid_count >= 3, dt_s);
}

static void emit_point(const struct point *point, struct marker *out)
{
	*out = (struct marker){.label = point->label,
			       .status = point->fix.used_count == 2 ? MARKER_TWO_CAMERA
								    : MARKER_MEASURED,
			       .camera_count = (uint8_t)point->fix.used_count,
			       .camera_mask = point->fix.used_mask,
			       .p_stage_m = point->fix.p_stage_m,
			       .residual_px = (float)point->fix.residual_px};
	memcpy(out->cov_m2, point->fix.cov_m2, sizeof(out->cov_m2));
}

static void emit_unseen(const struct tracker_state *state, const struct labelling *l,
			const struct pose *head, uint32_t i, struct marker *out)
{
	*out = (struct marker){.label = (int16_t)i, .status = MARKER_MISSING};
	if (!head || state->labels[i].seen_ns == 0)
		return;
	double variance_m2 = l->predictions.labels[i].sigma_m * l->predictions.labels[i].sigma_m;
	out->status = MARKER_PREDICTED;
	out->p_stage_m = pose_apply(head, state->labels[i].filled_m);
	out->cov_m2[0] = out->cov_m2[3] = out->cov_m2[5] = variance_m2;
}

/* The labels in the layout's order, then the points without a name. */
static void emit(struct tracker_state *state, const struct tracker_scratch *scratch,
		 const struct pose *head, struct marker_set *out)
{
	const struct matcher *m = &scratch->matcher;

	out->label_count = out->marker_count = state->label_count;
	out->markers_lost = 0;
	state->loose_count = 0;
	for (uint32_t i = 0; i < state->label_count; i++)
		emit_unseen(state, &scratch->labelling, head, i, &out->markers[i]);
	for (uint32_t p = 0; p < m->point_count; p++) {
		const struct point *point = &m->points[p];

		if (point->label != LABEL_NONE) {
			emit_point(point, &out->markers[point->label]);
			continue;
		}
		if (state->loose_count < LOOSE_MAX && point->fix.used_count >= 3)
			state->loose_stage_m[state->loose_count++] = point->fix.p_stage_m;
		if (out->marker_count == MARKER_MAX)
			out->markers_lost++;
		else
			emit_point(point, &out->markers[out->marker_count++]);
	}
}

/* Residuals beyond what the sigmas explain are learned, and forgotten when they go. */
static void learn_excess(struct tracker_state *state, const struct matcher *m)
{
	double chi2 = 0, dof = 0, residual_px2 = 0;

	for (uint32_t p = 0; p < m->point_count; p++) {
		const struct fix *fix = &m->points[p].fix;
		double fix_dof = 2 * fix->used_count - 3;

		if (fix->used_count < 3)
			continue;
		chi2 += fix_dof * fmin(fix->chi2_per_dof, EXCESS_CHI2_MAX);
		dof += fix_dof;
		residual_px2 += fix_dof * fix->residual_px * fix->residual_px;
	}
	if (dof < 10)
		return;
	double ratio = chi2 / dof, mean_px2 = residual_px2 / dof;
	/* residual / chi2 is the mean variance now assumed */
	state->excess_px2 += EXCESS_GAIN * (ratio - 1) * mean_px2 / fmax(ratio, 0.1);
	state->excess_px2 = fmin(fmax(state->excess_px2, 0), EXCESS_MAX_PX2);
}

static bool head_is_plausible(const struct tracker_scratch *scratch)
{
	const struct labelling *l = &scratch->labelling;
	int named = 0, points = (int)scratch->matcher.point_count;

	for (uint32_t i = 0; i < l->motion.count; i++)
		named += l->seen[i];
	return named >= 3 && named >= NAMED_SHARE_MIN * points;
}

/* Names, head pose and memory, given where the head is. Returns whether it really is there. */
static bool name_shot(struct tracker_state *state, struct tracker_scratch *scratch,
		      const struct layout *layout, int64_t now_ns, double dt_s, struct pose *head,
		      struct head *out)
{
	struct labelling *l = &scratch->labelling;

	label_points(l, state, layout, scratch->matcher.points, scratch->matcher.point_count, head,
		     now_ns);
	if (!head_is_plausible(scratch))
		return false;
	add_two_camera(state, scratch, layout, head);
	head_fit(layout, state, scratch->matcher.points, l->point_of_label, head, out);
	if (!out->valid)
		return false;
	*head = out->rt_stage_head;
	update_labels(state, scratch, layout, out, now_ns, dt_s);
	head_update(&state->head, head, now_ns);
	doubt_head(state, scratch, layout, out);
	return true;
}

void tracker_run(struct tracker_state *state, struct tracker_scratch *scratch,
		 const struct tracker_rig *rig, const struct shot *shot, struct marker_set *out)
{
	int64_t now_ns = shot->mid_exposure_ns;
	double dt_s = (double)(now_ns - state->mid_exposure_ns) * 1e-9;
	struct pose head = head_predict(&state->head, now_ns);
	bool measured = false;

	if (state->head.tracked && (double)(now_ns - state->head.seen_ns) * 1e-9 > HEAD_KEPT_S) {
		state->head.tracked = false;
		forget_names(state);
	}
	out->shot = shot->number;
	out->mid_exposure_ns = now_ns;
	out->uncertainty_ns = shot->uncertainty_ns;
	out->camera_count = shot->camera_count;
	out->missing_mask = shot->missing_mask;
	out->head_count = 1;
	out->heads[0] = (struct head){.valid = 0};

	predict_motion(state, rig->layout, now_ns, &scratch->labelling.motion);
	match_begin(&scratch->matcher, rig, state->excess_px2, shot);
	match_shot(state, scratch, &head);
	if (find_head(state, scratch, rig->layout, now_ns, &head))
		measured =
			name_shot(state, scratch, rig->layout, now_ns, dt_s, &head, &out->heads[0]);
	out->heads[0].valid = measured;
	if (!measured)
		scratch->labelling.predictions = scratch->labelling.motion;
	emit(state, scratch, measured || state->head.tracked ? &head : NULL, out);
	learn_excess(state, &scratch->matcher);
	state->mid_exposure_ns = now_ns;
}
