/*
 * The order of work for one shot, and what is remembered for the next.
 */
#include "track/tracker.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "track/emit.h"
#include "track/excess.h"
#include "track/ghost.h"
#include "track/head.h"
#include "track/head_seek.h"
#include "track/jig.h"
#include "track/label/crowd.h"
#include "track/label/jaw.h"
#include "track/label/label.h"
#include "track/label/remember.h"
#include "track/label/segment.h"
#include "track/match/match.h"
#include "track/match/point_size.h"
#include "track/match/point_views.h"
#include "track/predict.h"

#define FRAME_KEPT_S 0.25        /* what is not measured for longer is looked for anew */
#define SEED_RADIUS_MIN_M 0.0005 /* of a seed, and ... */
#define SEED_SIGMA 1.2           /* ... so many of what is expected, but at most ... */
#define SEED_RADIUS_M 0.004      /* ... this: all of it where nothing is expected */
#define LEARN_GAP_MAX_S 0.1      /* a longer gap teaches no more */
#define NAMED_SHARE_MIN 0.2      /* fewer names than this share of the points: the head is wrong */
#define HEAD_REACH_M 0.2
#define EXPECTED_WITHIN_NS \
	100000 /* of its time, a shot counts as the one expected: 0.1 mm at 1 m/s */

/* For what the seeds were made and projected, if for anything. */
struct preparation {
	const struct tracker_rig *rig; /* NULL: for nothing */
	int64_t last_ns;               /* of the shot before */
	int64_t time_ns;
};

struct tracker_scratch {
	struct preparation prepared;
	struct matcher matcher;
	struct crowd crowd;
	struct labelling labelling;
	struct seed seeds[SEED_MAX];
};

struct tracker_settings tracker_settings_default(void)
{
	return (struct tracker_settings){.match_gate_px = 1.0,
					 .calibration_sigma_px = 0.002,
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
	predict_init(state, layout);
}

static void lose_frame(struct tracker_state *state, int frame)
{
	state->frames[frame].tracked = state->frames[frame].was_held = false;
	remember_nothing(state, frame);
}

static bool is_stale(const struct frame_state *frame, int64_t time_ns)
{
	return frame->tracked && (double)(time_ns - frame->seen_ns) * 1e-9 > FRAME_KEPT_S;
}

static void predict_shot(const struct tracker_state *state, struct labelling *l, int64_t time_ns)
{
	for (uint32_t f = 0; f < state->frame_count; f++) {
		l->found[f] = false;
		l->rt_stage_frame[f] = head_predict(&state->frames[f], time_ns);
	}
	predict_motion(state, time_ns, &l->motion);
	label_expect_in_order(state, &l->motion);
}

static struct seed seed_of(const struct tracker_state *state, const struct labelling *l, uint32_t i)
{
	const struct label_state *label = &state->labels[i];
	const struct prediction *p = &l->motion.labels[i];
	bool just_seen = label->seen_ns == state->mid_exposure_ns;

	return (struct seed){pose_apply(&l->rt_stage_frame[label->frame], p->local_m),
			     fmin(SEED_RADIUS_M, SEED_RADIUS_MIN_M + SEED_SIGMA * p->sigma_m),
			     (int16_t)i, just_seen ? label->outvoted_mask : 0};
}

static void make_seeds(const struct tracker_state *state, struct tracker_scratch *scratch,
		       const struct tracker_rig *rig)
{
	struct labelling *l = &scratch->labelling;
	int count = 0;

	for (uint32_t i = 0; i < state->label_count; i++)
		if (state->frames[state->labels[i].frame].tracked)
			scratch->seeds[count++] = seed_of(state, l, i);
	for (uint32_t i = 0; i < state->loose_count; i++)
		scratch->seeds[count++] =
			(struct seed){state->loose_stage_m[i], SEED_RADIUS_M, LABEL_NONE, 0};
	match_prepare(&scratch->matcher, rig, scratch->seeds, count);
}

/* Where the markers should be in the shot, and where the cameras should see them. */
static void prepare(const struct tracker_state *state, struct tracker_scratch *scratch,
		    const struct tracker_rig *rig, int64_t time_ns)
{
	predict_shot(state, &scratch->labelling, time_ns);
	make_seeds(state, scratch, rig);
	scratch->prepared = (struct preparation){rig, state->mid_exposure_ns, time_ns};
}

static bool is_prepared(const struct tracker_state *state, const struct tracker_scratch *scratch,
			const struct tracker_rig *rig, int64_t time_ns)
{
	return scratch->prepared.rig == rig && scratch->prepared.time_ns == time_ns &&
	       scratch->prepared.last_ns == state->mid_exposure_ns;
}

static int64_t expected_ns(const struct tracker_state *state)
{
	return state->mid_exposure_ns + state->period_ns;
}

void tracker_prepare(const struct tracker_state *state, struct tracker_scratch *scratch,
		     const struct tracker_rig *rig)
{
	int64_t time_ns = expected_ns(state);

	if (state->period_ns == 0 || is_prepared(state, scratch, rig, time_ns))
		return;
	for (uint32_t f = 0; f < state->frame_count; f++)
		if (is_stale(&state->frames[f], time_ns))
			return; /* the shot will forget it first */
	prepare(state, scratch, rig, time_ns);
}

/* Takes what was prepared, or prepares it now. A shot that comes when it was expected is predicted
 * for that very time, so that it does not matter which. */
static void take_preparation(struct tracker_state *state, struct tracker_scratch *scratch,
			     const struct tracker_rig *rig, int64_t now_ns)
{
	int64_t late_ns = now_ns - expected_ns(state);
	bool expected = state->period_ns > 0 && late_ns <= EXPECTED_WITHIN_NS &&
			late_ns >= -EXPECTED_WITHIN_NS;
	int64_t time_ns = expected ? expected_ns(state) : now_ns;

	for (uint32_t f = 0; f < state->frame_count; f++)
		if (is_stale(&state->frames[f], time_ns))
			lose_frame(state, (int)f);
	if (!is_prepared(state, scratch, rig, time_ns))
		prepare(state, scratch, rig, time_ns);
	scratch->prepared.rig = NULL;
}

/* Few names among many points: the head is not where it seemed. */
static bool frame_is_plausible(const struct tracker_state *state, const struct labelling *l,
			       int frame)
{
	const struct frame_state *f = &state->frames[frame];
	struct vec3 middle_m = l->rt_stage_frame[frame].t;
	int named = 0, points = 0;

	for (int i = f->label_first; i < f->label_end; i++)
		named += l->seen[i] && state->labels[i].frame == frame;
	for (int k = 0; k < l->nearby.count; k++)
		points += vec3_distance(l->nearby.p_stage_m[k], middle_m) < HEAD_REACH_M;
	if ((uint32_t)frame >= state->actor_count)
		return named >= 1;
	return named >= 3 && named >= NAMED_SHARE_MIN * points;
}

/* The frame is not found after all. */
static void drop_frame(const struct tracker_state *state, struct labelling *l, int frame)
{
	const struct frame_state *f = &state->frames[frame];

	l->found[frame] = false;
	for (int i = f->label_first; i < f->label_end; i++)
		if (state->labels[i].frame == frame) {
			l->seen[i] = false;
			l->point_of_label[i] = ASSIGN_NONE;
		}
}

/* The final pose of every found frame, from its names. */
static void fit_frames(struct tracker_state *state, struct labelling *l, const struct point *points,
		       struct head fits[FRAME_MAX])
{
	for (uint32_t f = 0; f < state->frame_count; f++) {
		fits[f] = (struct head){.valid = 0};
		if (!l->found[f])
			continue;
		if (f < state->actor_count)
			head_fit(state, (int)f, points, l->point_of_label, &l->rt_stage_frame[f],
				 &fits[f]);
		else
			segment_fit(state, l, (int)f, points, &fits[f]);
		if (fits[f].valid)
			l->rt_stage_frame[f] = fits[f].rt_stage_head;
		else
			drop_frame(state, l, (int)f);
	}
}

/* What the next shot starts from. */
static void remember_frame(struct tracker_state *state, struct tracker_scratch *scratch, int frame,
			   struct head *fit, int64_t now_ns, double dt_s)
{
	struct frame_state *f = &state->frames[frame];
	struct matcher *m = &scratch->matcher;

	head_update(f, &fit->rt_stage_head, now_ns);
	f->held_count = fit->rigid_count;
	if (fit->rigid_count >= 3)
		f->held_ns = now_ns;
	if ((uint32_t)frame >= state->actor_count) {
		if (fit->rigid_count < 3) /* one axis was only guessed */
			f->turn_rate_rad_s = f->velocity_m_s = (struct vec3){0, 0, 0};
		return;
	}
	if (fit->rigid_count >= 3)
		jig_watch(state, &scratch->labelling, frame, dt_s);
	fit->slip_m = state->faces[frame].slipped_m;
	fit->jig_slip = fit->slip_m > 0;
	if (!crowd_doubt(&scratch->crowd, state, &scratch->labelling, m->points, m->point_count,
			 frame, fit))
		lose_frame(state, frame);
}

/* Who is larger or smaller than all that is worn gets no name and casts no doubt, nor does who is
 * not sure. */
static void measure_points(const struct tracker_state *state, const struct matcher *m,
			   struct labelling *l)
{
	bool skip[POINT_MAX];

	for (uint32_t p = 0; p < m->point_count; p++) {
		l->sizes[p] = point_size(m, &state->blur, &m->points[p]);
		l->is_strained[p] = point_is_strained(m, &m->points[p]);
		l->merged[p] = point_is_merged(m, &m->points[p]);
		skip[p] = point_size_is_larger(&l->sizes[p], state->diameter_max_m) ||
			  point_size_is_smaller(&l->sizes[p], state->diameter_min_m) ||
			  point_is_unsure(m, &m->points[p]);
	}
	nearby_build(&l->nearby, m->points, m->point_count, skip);
}

/* Names, poses and memory, given where the frames are. */
static void name_shot(struct tracker_state *state, struct tracker_scratch *scratch, int64_t now_ns,
		      double dt_s, struct head fits[FRAME_MAX])
{
	struct labelling *l = &scratch->labelling;
	struct matcher *m = &scratch->matcher;
	bool anchored[FRAME_MAX];

	ghost_recognise(state, l, m->points, m->point_count, l->is_ghost);
	jaw_lean(state, l);
	label_points(l, state, m->points, m->point_count, now_ns);
	for (uint32_t f = 0; f < state->frame_count; f++)
		if (l->found[f] && !frame_is_plausible(state, l, (int)f))
			drop_frame(state, l, (int)f);
	remember_two_camera(l, state, m);
	label_doubt_lonely(l, state);
	fit_frames(state, l, m->points, fits);
	for (uint32_t f = 0; f < state->frame_count; f++)
		anchored[f] = fits[f].rigid_count >= 3;
	remember_labels(l, state, m->points, anchored, now_ns, dt_s);
	match_learn_looks(m, state);
	ghost_learn(state, l, m->points, m->point_count, dt_s);
	for (uint32_t f = 0; f < state->frame_count; f++)
		if (l->found[f])
			remember_frame(state, scratch, (int)f, &fits[f], now_ns, dt_s);
}

static void begin_set(const struct tracker_state *state, const struct shot *shot,
		      struct marker_set *out)
{
	out->shot = shot->number;
	out->mid_exposure_ns = shot->mid_exposure_ns;
	out->uncertainty_ns = shot->uncertainty_ns;
	out->camera_count = shot->camera_count;
	out->missing_mask = shot->missing_mask;
	out->head_count = state->actor_count;
}

void tracker_run(struct tracker_state *state, struct tracker_scratch *scratch,
		 const struct tracker_rig *rig, const struct shot *shot, struct marker_set *out)
{
	struct labelling *l = &scratch->labelling;
	struct matcher *m = &scratch->matcher;
	int64_t now_ns = shot->mid_exposure_ns;
	double gap_s = (double)(now_ns - state->mid_exposure_ns) * 1e-9;
	double dt_s = state->mid_exposure_ns ? fmin(gap_s, LEARN_GAP_MAX_S) : 0;
	struct head fits[FRAME_MAX];
	bool shown[FRAME_MAX];

	begin_set(state, shot, out);
	take_preparation(state, scratch, rig, now_ns);
	match_begin(m, rig, &state->excess, shot);
	if (seek_heads(state, l, m))
		make_seeds(state, scratch, rig);
	match_part_merged(m, state);
	match_seeds(m);
	match_leftovers(m);
	measure_points(state, m, l);
	crowd_find(&scratch->crowd, state, l, m->points, m->point_count, now_ns);
	name_shot(state, scratch, now_ns, dt_s, fits);
	for (uint32_t f = 0; f < state->frame_count; f++)
		shown[f] = l->found[f] || state->frames[f].tracked;
	for (uint32_t a = 0; a < state->actor_count; a++)
		out->heads[a] = fits[a];
	emit_markers(state, l, m->points, m->point_count, shown, out);
	excess_learn(state, m);
	point_size_learn(state, m);
	state->period_ns = state->mid_exposure_ns ? now_ns - state->mid_exposure_ns : 0;
	state->mid_exposure_ns = now_ns;
}
