/*
 * Blobs that no seed explains: those of every two cameras that lie in one epipolar plane, where
 * other cameras confirm their point.
 */
#include <stddef.h>

#include "track/match_parts.h"
#include "track/sight_index.h"

#define PAIR_BUDGET 60000 /* epipolar pairs looked at closely in one shot */
#define SURE_VIEW_COUNT 4 /* such a point may claim its blobs at once */

/* The middle of the shortest line between two rays; false when they do not meet in front. */
static bool rays_meet(const struct sight_index *a, int blob_a, const struct sight_index *b,
		      int blob_b, struct vec3 *out)
{
	struct vec3 da = a->ray[blob_a], db = b->ray[blob_b];
	struct vec3 between = vec3_sub(b->view->centre_stage_m, a->view->centre_stage_m);
	double cosine = vec3_dot(da, db), sine2 = 1 - cosine * cosine;

	if (sine2 < 1e-6)
		return false;
	double along_a = (vec3_dot(between, da) - vec3_dot(between, db) * cosine) / sine2;
	double along_b = (vec3_dot(between, da) * cosine - vec3_dot(between, db)) / sine2;
	if (along_a <= 0 || along_b <= 0)
		return false;
	struct vec3 pa = vec3_add(a->view->centre_stage_m, vec3_scale(da, along_a));
	struct vec3 pb = vec3_add(b->view->centre_stage_m, vec3_scale(db, along_b));
	*out = vec3_scale(vec3_add(pa, pb), 0.5);
	return true;
}

/* Nearest free blob to p in every camera, within the gate; the pair's own two first, as most false
 * pairs fail there. False when fewer than three cameras have one. */
static bool choose_around(const struct matcher *m, struct vec3 p, uint32_t ca, uint32_t cb,
			  struct choice *out)
{
	double pixel[2];

	out->count = 0;
	for (uint32_t k = 0; k < m->camera_count + 2; k++) {
		uint32_t c = k == 0 ? ca : k == 1 ? cb : k - 2;
		const struct sight_index *camera = &m->cameras[c];

		if (k >= 2 && (c == ca || c == cb))
			continue;
		out->blob[c] = BLOB_NONE;
		if (camera->view && view_project(camera->view, p, pixel, NULL))
			out->blob[c] = (int16_t)sight_index_nearest(camera, pixel,
								    m->settings->match_gate_px);
		out->count += out->blob[c] != BLOB_NONE;
		if (k < 2 && out->blob[c] == BLOB_NONE)
			return false;
	}
	out->guess_stage_m = p;
	out->at_guess = NULL;
	return out->count >= 3;
}

/* A blob of camera a and one of camera b: is there a point that other cameras confirm? */
static void try_pair(struct matcher *m, uint32_t ca, int blob_a, uint32_t cb, int blob_b)
{
	struct vec3 p;
	struct point point;
	struct choice choice;

	if (!rays_meet(&m->cameras[ca], blob_a, &m->cameras[cb], blob_b, &p) ||
	    !point_in_range(m, p, 1u << ca | 1u << cb) || !choose_around(m, p, ca, cb, &choice))
		return;
	choice.blob[ca] = (int16_t)blob_a;
	choice.blob[cb] = (int16_t)blob_b;
	if (!point_from_choice(m, &choice, &point) || !point_confirmed(m, &point, 3))
		return;
	if (point.fix.used_count >= SURE_VIEW_COUNT &&
	    point.fix.residual_px < 0.25 * m->settings->match_gate_px)
		claim(m, &point);
	else
		add_candidate(m, &point);
}

/* All free blobs of two cameras against each other's epipolar planes. */
static int match_camera_pair(struct matcher *m, uint32_t ca, uint32_t cb, int budget)
{
	struct sight_index *a = &m->cameras[ca], *b = &m->cameras[cb];
	struct vec3 baseline = vec3_sub(b->view->centre_stage_m, a->view->centre_stage_m);
	double gate_rad = m->settings->match_gate_px / a->pixels_per_radian +
			  m->settings->match_gate_px / b->pixels_per_radian;

	for (int i = 0; i < a->free_count; i++) {
		int blob_a = a->free[i];
		struct vec3 normal = vec3_unit(vec3_cross(baseline, a->ray[blob_a]));

		for (int j = 0; j < b->free_count && a->owner[blob_a] < 0; j++) {
			int blob_b = b->free[j];

			if (fabs(vec3_dot(normal, b->ray[blob_b])) > gate_rad ||
			    b->owner[blob_b] >= 0)
				continue;
			if (budget-- == 0)
				return 0;
			try_pair(m, ca, blob_a, cb, blob_b);
		}
	}
	return budget;
}

void match_leftovers(struct matcher *m)
{
	int budget = PAIR_BUDGET;

	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view)
			sight_index_free(&m->cameras[c]);
	for (uint32_t a = 0; a < m->camera_count; a++)
		for (uint32_t b = a + 1; b < m->camera_count && budget > 0; b++)
			if (m->cameras[a].view && m->cameras[b].view)
				budget = match_camera_pair(m, a, b, budget);
	claim_candidates(m);
}
