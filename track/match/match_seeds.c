/*
 * Seeds: each is projected once, the blobs around give a point, and around the point it is looked
 * again, the projections carried on by their slopes.
 */
#include "track/match/match.h"

#include <stdbool.h>
#include <string.h>

#include "track/match/match_parts.h"
#include "track/match/sight_index.h"

#define NEAR_MAX 6 /* blobs looked at, where the nearest will not do */

/* How far a seed may be off in the image. */
static double reach_px_of(const struct matcher *m, const struct sight_index *camera, int index)
{
	return m->seeds[index].radius_m * camera->pixels_per_radian /
	       vec3_distance(m->seed_stage_m[index], camera->view->centre_stage_m);
}

/* Of a free blob the nearest that may show the seed, where the nearest of all may not. */
static int nearest_shown(const struct matcher *m, uint32_t c, int nearest, int index,
			 const double pixel[2], double radius_px)
{
	const struct sight_index *camera = &m->cameras[c];
	int16_t near[NEAR_MAX];
	double best_px = radius_px;
	int best = BLOB_NONE;

	if (nearest == BLOB_NONE || match_may_show(m, c, nearest, m->seeds[index].label))
		return nearest;
	int count = sight_index_within(camera, pixel, radius_px, near, NEAR_MAX);
	for (int k = 0; k < count; k++) {
		const struct blob *blob = &camera->blobs[near[k]];
		double off_px = hypot(blob->x_px - pixel[0], blob->y_px - pixel[1]);

		if (off_px < best_px && match_may_show(m, c, near[k], m->seeds[index].label)) {
			best_px = off_px;
			best = near[k];
		}
	}
	return best;
}

/* The camera's nearest blob to the seed, within its radius or the gate, whichever is larger. */
static void choose_for_seed(struct matcher *m, uint32_t c, int index, double reach_px)
{
	const struct sight_index *camera = &m->cameras[c];
	const double *pixel = m->seen[c][index].pixel;
	double gate_px = m->settings->match_gate_px, radius_px = fmax(reach_px, gate_px);
	int nearest = sight_index_nearest_alone(camera, pixel, radius_px, reach_px + gate_px,
						&m->seed_alone[index]);

	m->seed_blob[c][index] = (int16_t)nearest_shown(m, c, nearest, index, pixel, radius_px);
}

static void choose_for_seeds(struct matcher *m, uint32_t c)
{
	const struct sight_index *camera = &m->cameras[c];
	double reach_px[SEED_MAX];

	for (int i = 0; camera->view && i < m->seed_count; i++)
		reach_px[i] = reach_px_of(m, camera, i);
	for (int i = 0; i < m->seed_count; i++) {
		m->seed_blob[c][i] = BLOB_NONE;
		if (camera->view && m->in_sight[c][i])
			choose_for_seed(m, c, i, reach_px[i]);
	}
}

static void take_seed(const struct matcher *m, int index, struct choice *out)
{
	out->guess_stage_m = m->seed_stage_m[index];
	out->seed = index;
	out->outvoted_mask = m->seeds[index].outvoted_mask;
	out->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		out->blob[c] = m->seed_blob[c][index];
		out->count += out->blob[c] != BLOB_NONE;
	}
}

/* Nearest free blob to each camera's sight of p, within the gate. */
static void choose_again(const struct matcher *m, int index, struct vec3 p, struct choice *out)
{
	out->guess_stage_m = p;
	out->seed = -1;
	out->outvoted_mask = m->seeds[index].outvoted_mask;
	out->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		const struct sight_index *camera = &m->cameras[c];
		double pixel[2];

		out->blob[c] = BLOB_NONE;
		if (camera->view && project_near(m, c, p, index, pixel))
			out->blob[c] = (int16_t)sight_index_nearest(camera, pixel,
								    m->settings->match_gate_px);
		if (out->blob[c] != BLOB_NONE)
			out->blob[c] = (int16_t)nearest_shown(m, c, out->blob[c], index, pixel,
							      m->settings->match_gate_px);
		out->count += out->blob[c] != BLOB_NONE;
	}
}

/* The blobs chosen around a seed are those that would be chosen around the solution: it fits them
 * all, and no other blob could come into reach. */
static bool choice_stands(const struct matcher *m, int index, const struct point *point)
{
	double gate_px = m->settings->match_gate_px, residual_px = point->fix.residual_px;

	return m->seed_alone[index] && point->fix.used_mask == point->claimed_mask &&
	       residual_px * residual_px * point->fix.used_count < gate_px * gate_px &&
	       vec3_distance(m->seed_stage_m[index], point->fix.p_stage_m) <
		       m->seeds[index].radius_m;
}

/* From a seed to a confirmed point: solve, look again around the solution, solve. */
static bool point_near(const struct matcher *m, int index, struct point *out)
{
	struct choice first, again;

	take_seed(m, index, &first);
	if (first.count < 3 || !point_from_choice(m, &first, out))
		return false;
	if (!choice_stands(m, index, out)) {
		choose_again(m, index, out->fix.p_stage_m, &again);
		if (again.count < 3)
			return false;
		if (memcmp(first.blob, again.blob, m->camera_count * sizeof(first.blob[0])) &&
		    !point_from_choice(m, &again, out))
			return false;
	}
	/* where a marker was expected, two that agree may outvote a third */
	return point_confirmed(m, out, 2);
}

bool match_try_seed(struct matcher *m, int index, struct point *out)
{
	m->seed_alone[index] = true;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		const struct sight_index *camera = &m->cameras[c];

		m->seed_blob[c][index] = BLOB_NONE;
		if (camera->view && m->in_sight[c][index])
			choose_for_seed(m, c, index, reach_px_of(m, camera, index));
	}
	return point_near(m, index, out) && out->fix.used_count >= 3;
}

_Static_assert(SEED_MAX <= CANDIDATE_MAX, "each seed may give one");

void match_seeds(struct matcher *m)
{
	for (int i = 0; i < m->seed_count; i++)
		m->seed_alone[i] = true;
	for (uint32_t c = 0; c < m->camera_count; c++)
		choose_for_seeds(m, c);
	for (int i = 0; i < m->seed_count; i++)
		m->candidate_count += point_near(m, i, &m->candidates[m->candidate_count]);
	claim_candidates(m);
}
