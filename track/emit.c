/*
 * Points keep the name that remember_labels() gave them; labels without one are filled in.
 */
#include "track/emit.h"

#include <string.h>

#include "track/fill.h"
#include "track/label/wear.h"

#define MARGIN_MAX 20.0 /* squared sigmas that are still believed */
#define YOUNG_DOUBT 0.02
#define YOUNG_S 0.3
#define HASTY_DOUBT 0.02
#define TWO_CAMERA_CONFIDENCE 0.97f

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

/* In head coordinates, and as the master neutral would have it. */
static void emit_layers(const struct tracker_state *state, const struct labelling *l, uint32_t i,
			const bool *shown, struct marker *out)
{
	const struct label_state *label = &state->labels[i];
	const struct pose *head = &l->rt_stage_frame[label->actor];

	if (out->status == MARKER_MISSING || !shown[label->actor])
		return;
	struct pose back = pose_inverse(head);
	struct vec3 p = pose_apply(&back, out->p_stage_m);
	struct vec3 n = vec3_sub(p, vec3_sub(label->base_m, label->master_m));

	out->flags |= MARKER_STABILISED;
	memcpy(out->stabilised_m, (float[]){(float)p.x, (float)p.y, (float)p.z},
	       sizeof(out->stabilised_m));
	if (label->kind == LABEL_BODY || label->base_count == 0)
		return;
	out->flags |= MARKER_NORMALISED;
	memcpy(out->normalised_m, (float[]){(float)n.x, (float)n.y, (float)n.z},
	       sizeof(out->normalised_m));
}

/* Skin that moves by a marker's distance from shot to shot may be followed one marker aside. */
static double hasty_doubt(const struct label_state *label, int64_t period_ns)
{
	double step_m = vec3_norm(label->velocity_m_s) * (double)period_ns * 1e-9;
	double share = fmin(step_m / label->spacing_m, 1);

	return HASTY_DOUBT * share * share * share * share;
}

/* The chance that the name is right: what speaks for another reading, for how long it has been
 * followed without a gap, how fast, and whether a third camera confirms the place. */
static float confidence_of(const struct labelling *l, const struct tracker_state *state, uint32_t i,
			   int camera_count)
{
	const struct label_state *label = &state->labels[i];
	double other = 0.5 * exp(-0.5 * fmin(l->margin[i], MARGIN_MAX));
	double young = YOUNG_DOUBT * exp(-label->unbroken_s / YOUNG_S) +
		       hasty_doubt(label, state->period_ns);

	if (camera_count == 2)
		return (float)fmin(TWO_CAMERA_CONFIDENCE, 1 - young);
	return (float)(1 - fmin(other + young, 1));
}

/* A point that may be it stands for it; as long as that is not sure, it may as well be elsewhere.
 */
static double take_unsure(const struct labelling *l, uint32_t i, struct filled *filled)
{
	struct vec3 off = vec3_sub(l->seen_m[i], filled->local_m);

	filled->local_m = l->seen_m[i];
	return vec3_dot(off, off) / 3;
}

static void emit_unseen(const struct tracker_state *state, const struct labelling *l,
			const struct point *points, uint32_t i, bool shown, int64_t now_ns,
			struct marker *out)
{
	const struct label_state *label = &state->labels[i];

	*out = (struct marker){.label = (int16_t)i, .status = MARKER_MISSING};
	if (wear_is_gone(label))
		out->flags |= MARKER_GONE;
	if (!shown || label->seen_ns == 0 || wear_is_gone(label))
		return;
	struct filled filled = fill_place(state, l, points, i, now_ns);
	double variance_m2 = filled.sigma_m * filled.sigma_m;
	if (l->seen[i])
		variance_m2 += take_unsure(l, i, &filled);
	out->status = MARKER_PREDICTED;
	out->p_stage_m = pose_apply(&l->rt_stage_frame[label->frame], filled.local_m);
	out->cov_m2[0] = out->cov_m2[3] = out->cov_m2[5] = variance_m2;
}

static void emit_named(const struct tracker_state *state, const struct labelling *l,
		       const struct point *point, struct marker_set *out)
{
	struct marker *marker = &out->markers[point->label];
	uint32_t i = (uint32_t)point->label;

	emit_point(point, marker);
	marker->confidence = confidence_of(l, state, i, point->fix.used_count);
}

static void emit_loose(struct tracker_state *state, const struct point *point, bool is_ghost,
		       struct marker_set *out)
{
	if (state->loose_count < LOOSE_MAX && point->fix.used_count >= 3)
		state->loose_stage_m[state->loose_count++] = point->fix.p_stage_m;
	if (out->marker_count == MARKER_MAX) {
		out->markers_lost++;
		return;
	}
	emit_point(point, &out->markers[out->marker_count]);
	out->markers[out->marker_count++].flags |= is_ghost ? MARKER_GHOST : 0;
}

void emit_markers(struct tracker_state *state, const struct labelling *l,
		  const struct point *points, uint32_t point_count, const bool *shown,
		  struct marker_set *out)
{
	bool named[LABEL_MAX] = {false};

	out->label_count = out->marker_count = state->label_count;
	out->markers_lost = 0;
	state->loose_count = 0;
	for (uint32_t p = 0; p < point_count; p++) {
		int16_t label = points[p].label;

		if (label == LABEL_NONE) {
			emit_loose(state, &points[p],
				   points[p].fix.used_count >= 3 && l->is_ghost[p], out);
			continue;
		}
		emit_named(state, l, &points[p], out);
		named[label] = true;
	}
	for (uint32_t i = 0; i < state->label_count; i++)
		if (!named[i])
			emit_unseen(state, l, points, i, shown[state->labels[i].frame],
				    out->mid_exposure_ns, &out->markers[i]);
	for (uint32_t i = 0; i < state->label_count; i++)
		emit_layers(state, l, i, shown, &out->markers[i]);
}
