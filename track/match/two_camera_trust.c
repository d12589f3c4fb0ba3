/*
 * Whether what two cameras show together is a label's marker.
 */
#include <math.h>
#include <stddef.h>

#include "track/label/wear.h"
#include "track/match/match_parts.h"
#include "track/match/two_camera.h"

#define NEAR_M 0.0015     /* from where it is told, beside what that is off by */
#define VAGUE_PX 0.45f    /* of a merged spot: neither; a part of one is surer */
#define NOISE_MAX_M 0.001 /* of the pair */
#define FACE_SIGMA 3.0    /* ... and no farther from where the whole face has it */

#define RIVAL_MARGIN 5.0 /* squared sigmas by which a blob fits this one better */
#define ROUNDED 1.0      /* ... and more than rounding makes of such costs */

bool two_camera_joins_in(const struct labelling *l, const struct tracker_state *state, uint32_t i,
			 const struct point *point)
{
	const struct label_state *label = &state->labels[i];

	if (label->kind != LABEL_SKIN && !l->motion.labels[i].recent)
		return false;
	for (uint32_t left = point->fix.used_mask & ~label->camera_mask; left; left &= left - 1)
		if (state->looks[i].sees[__builtin_ctz(left)] < LOOK_SEES_LEAST)
			return true;
	return false;
}

/* It must stay where the neighbours tell, as it did when three cameras saw it. */
static bool fits(const struct labelling *l, const struct tracker_state *state, uint32_t i,
		 const struct point *point, struct vec3 local_m)
{
	const struct label_state *label = &state->labels[i];
	struct vec3 told_m;
	double sigma_m;

	if (label->kind != LABEL_SKIN)
		return true;
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
	return vec3_distance(told_m, local_m) < NEAR_M + 2.5 * sigma_m;
}

/* Cameras that saw the marker when that was last seen, or see one of those next to it. */
static uint32_t cameras_that_may_see(const struct labelling *l, const struct tracker_state *state,
				     const struct matcher *matcher, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	uint32_t mask = own->camera_mask;

	for (int k = 0; k < WATCH_MAX; k++)
		if (own->watch[k] >= 0 && l->point_of_label[own->watch[k]] >= 0)
			mask |= matcher->points[l->point_of_label[own->watch[k]]].fix.used_mask;
	return mask;
}

/* A blob of a camera, and how far labels may be from it. */
struct shown {
	uint32_t camera;
	const struct blob *blob;
	double sigma_px;
	double least_cost; /* of any label */
};

/* What of a negative log-likelihood (times 2) in the plane the distance does not change. */
static double cost_of_vague(double sigma_px)
{
	return 4 * log(sigma_px);
}

static struct shown shown_by(const struct matcher *matcher, uint32_t c, const struct point *point)
{
	const struct blob *blob = &matcher->cameras[c].blobs[point->blob[c]];
	double sigma_px = match_sigma_px(matcher, c, blob);

	return (struct shown){c, blob, sigma_px, cost_of_vague(sigma_px)};
}

/* Negative log-likelihood (times 2) of a blob that shows this label, up to a constant. What is
 * `enough`, surely and not by rounding, is not worked out. */
static double blob_cost(const struct labelling *l, const struct matcher *matcher, uint32_t label,
			const struct shown *shown, double enough)
{
	const struct sight_index *camera = &matcher->cameras[shown->camera];
	struct vec3 where_m = l->expected_m[label];
	double pixel[2];

	if (!project_near(matcher, shown->camera, where_m, matcher->seed_of_label[label], pixel))
		return INFINITY;
	double range_m = vec3_distance(where_m, camera->view->centre_stage_m);
	double vague_px =
		l->predictions.labels[label].sigma_m * camera->pixels_per_radian / range_m;
	double x_px = shown->blob->x_px - pixel[0], y_px = shown->blob->y_px - pixel[1];
	double variance_px2 = shown->sigma_px * shown->sigma_px + vague_px * vague_px;
	if (x_px * x_px + y_px * y_px > (enough - shown->least_cost + ROUNDED) * variance_px2)
		return INFINITY;
	double sigma_px = hypot(shown->sigma_px, vague_px), off_px = hypot(x_px, y_px);
	return off_px * off_px / (sigma_px * sigma_px) + cost_of_vague(sigma_px);
}

/* A label without a point, which the camera may see, could mean one of the two blobs as well. */
static bool has_rival(const struct labelling *l, const struct tracker_state *state,
		      const struct matcher *matcher, uint32_t label, const struct point *point)
{
	struct shown shown[CAMERA_MAX];
	double enough[CAMERA_MAX];
	int count = 0;

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		shown[count] = shown_by(matcher, (uint32_t)__builtin_ctz(left), point);
		enough[count] =
			blob_cost(l, matcher, label, &shown[count], INFINITY) + RIVAL_MARGIN;
		count++;
	}
	for (uint32_t i = 0; i < state->label_count; i++) {
		if (l->point_of_label[i] != ASSIGN_NONE || i == label ||
		    !l->found[state->labels[i].frame] || wear_is_gone(&state->labels[i]))
			continue;
		uint32_t mask = cameras_that_may_see(l, state, matcher, i);
		for (int k = 0; k < count; k++)
			if (mask >> shown[k].camera & 1 &&
			    blob_cost(l, matcher, i, &shown[k], enough[k]) < enough[k])
				return true;
	}
	return false;
}

/* Where two markers are one spot that is not parted, the spot is neither; and a half lies where it
 * was expected, if the spot was one marker's alone: it is a sight only of lips or lids that meet,
 * where the spot itself says that it is two. */
static bool is_merged(const struct matcher *matcher, const struct point *point)
{
	for (uint32_t left = point->claimed_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		const struct blob *blob = &matcher->cameras[c].blobs[point->blob[c]];

		if (blob->flags & BLOB_MERGED && blob->sigma_px > VAGUE_PX)
			return true;
		if (match_is_half(matcher, c, point->blob[c], NULL) &&
		    matcher->half_kind[c][point->blob[c]] != HALF_PLAIN)
			return true;
	}
	return false;
}

/* Who may be off by so much is no measurement; of two merged spots half of it is too much. */
static bool is_vague(const struct matcher *matcher, const struct point *point)
{
	bool plain = false;

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		plain |= !(matcher->cameras[c].blobs[point->blob[c]].flags & BLOB_MERGED);
	}
	return fix_noise_m(&point->fix) > (plain ? NOISE_MAX_M : 0.5 * NOISE_MAX_M);
}

bool two_camera_is_it(const struct labelling *l, const struct tracker_state *state,
		      const struct matcher *matcher, uint32_t i, const struct point *point,
		      struct vec3 local_m)
{
	struct point_size size = point_size(matcher, &state->blur, point);

	return match_sure_views(matcher, point) == 2 && !is_merged(matcher, point) &&
	       !is_vague(matcher, point) && !two_camera_joins_in(l, state, i, point) &&
	       point_size_fits(&size, state->labels[i].diameter_m) &&
	       fits(l, state, i, point, local_m) && !has_rival(l, state, matcher, i, point);
}
