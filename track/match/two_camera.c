/*
 * Markers that only two cameras see: nothing but the neighbours can contradict them, and left alone
 * they would drift off with a wrong blob.
 */
#include "track/label/remember.h"

#define TWO_CAMERA_MIN_M 0.0015 /* how far from its prediction a two-camera marker may be */
#define TWO_CAMERA_MAX_M 0.005
#define TWO_CAMERA_SHARE 0.45     /* ... of the distance to the next marker */
#define TWO_CAMERA_SIGMA_M 0.0025 /* who is expected more vaguely needs three */
#define VAGUE_PX 0.45f            /* of a merged spot: neither; a part of one is surer */
#define FACE_SIGMA 3.0            /* ... and no farther from where the whole face has it */

/* It must stay where the neighbours tell, as it did when three cameras saw it. */
static bool fits(const struct labelling *l, const struct tracker_state *state, uint32_t i,
		 const struct point *point, struct vec3 local_m)
{
	const struct label_state *label = &state->labels[i];
	struct vec3 told_m;
	double sigma_m;

	if (label->kind != LABEL_SKIN)
		return true;
	/* a camera that did not see it a moment ago sees another marker, or a stray light */
	if (point->fix.used_mask & ~label->camera_mask)
		return false;
	if (l->told[i].known &&
	    vec3_distance(l->told[i].local_m, local_m) >
		    FACE_SIGMA * (l->told[i].sigma_m + fix_noise_m(&point->fix)))
		return false;
	predict_told(state, label, l->seen, l->seen_m, &told_m, &sigma_m);
	told_m = vec3_add(told_m, label->offset_m);
	if (label->rest_variance_m2 < sigma_m * sigma_m) {
		told_m = label->rest_m;
		sigma_m = sqrt(label->rest_variance_m2);
	}
	return vec3_distance(told_m, local_m) < TWO_CAMERA_MIN_M + 2.5 * sigma_m;
}

/* Where two markers are one spot that is not parted, the spot is neither. */
static bool is_merged(const struct matcher *matcher, const struct point *point)
{
	for (uint32_t c = 0; c < matcher->camera_count; c++)
		if ((point->claimed_mask & (1u << c)) &&
		    matcher->cameras[c].blobs[point->blob[c]].flags & BLOB_MERGED &&
		    matcher->cameras[c].blobs[point->blob[c]].sigma_px > VAGUE_PX)
			return true;
	return false;
}

void remember_two_camera(struct labelling *l, const struct tracker_state *state,
			 struct matcher *matcher)
{
	for (uint32_t i = 0; i < state->label_count; i++) {
		const struct prediction *p = &l->predictions.labels[i];
		int frame = state->labels[i].frame;

		if (!l->found[frame] || l->assign.column_of_row[i] != ASSIGN_NONE ||
		    (state->labels[i].kind == LABEL_SKIN && p->sigma_m > TWO_CAMERA_SIGMA_M))
			continue;
		struct seed seed = {
			pose_apply(&l->rt_stage_frame[frame], p->local_m),
			fmin(fmax(TWO_CAMERA_MIN_M, 2.5 * p->sigma_m),
			     fmin(TWO_CAMERA_MAX_M, TWO_CAMERA_SHARE * state->labels[i].spacing_m)),
			(int16_t)i};
		int point = match_two_cameras(matcher, &seed);
		if (point < 0)
			continue;
		const struct point *found = &matcher->points[point];
		struct vec3 local_m = pose_apply(&l->rt_frame_stage[frame], found->fix.p_stage_m);
		struct point_size size = point_size(matcher, &state->blur, found);
		if (is_merged(matcher, found) || !fits(l, state, i, found, local_m) ||
		    !point_size_fits(&size, state->labels[i].diameter_m))
			continue;
		l->point_of_label[i] = (int16_t)point;
		l->seen[i] = true;
		l->seen_m[i] = local_m;
	}
}
