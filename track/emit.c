/*
 * Points keep the name that remember_labels() gave them; labels without one are filled in.
 */
#include "track/emit.h"

#include <string.h>

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

static void emit_unseen(const struct tracker_state *state, const struct labelling *l, uint32_t i,
			bool shown, struct marker *out)
{
	const struct label_state *label = &state->labels[i];

	*out = (struct marker){.label = (int16_t)i, .status = MARKER_MISSING};
	if (!shown || label->seen_ns == 0)
		return;
	double variance_m2 = l->predictions.labels[i].sigma_m * l->predictions.labels[i].sigma_m;
	out->status = MARKER_PREDICTED;
	out->p_stage_m = pose_apply(&l->rt_stage_frame[label->frame], label->filled_m);
	out->cov_m2[0] = out->cov_m2[3] = out->cov_m2[5] = variance_m2;
}

static void emit_loose(struct tracker_state *state, const struct point *point,
		       struct marker_set *out)
{
	if (state->loose_count < LOOSE_MAX && point->fix.used_count >= 3)
		state->loose_stage_m[state->loose_count++] = point->fix.p_stage_m;
	if (out->marker_count == MARKER_MAX)
		out->markers_lost++;
	else
		emit_point(point, &out->markers[out->marker_count++]);
}

void emit_markers(struct tracker_state *state, const struct labelling *l,
		  const struct point *points, uint32_t point_count, const bool *shown,
		  struct marker_set *out)
{
	out->label_count = out->marker_count = state->label_count;
	out->markers_lost = 0;
	state->loose_count = 0;
	for (uint32_t i = 0; i < state->label_count; i++)
		emit_unseen(state, l, i, shown[state->labels[i].frame], &out->markers[i]);
	for (uint32_t p = 0; p < point_count; p++) {
		if (points[p].label == LABEL_NONE)
			emit_loose(state, &points[p], out);
		else
			emit_point(&points[p], &out->markers[points[p].label]);
	}
}
