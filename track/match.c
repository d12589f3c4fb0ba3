/*
 * Candidates are built freely, several may want the same blob; then they claim their blobs in the
 * order of how well they are confirmed: more views first, then the smaller residual.
 */
#include "track/match.h"

#include <stdbool.h>
#include <string.h>

#include "track/sight_index.h"

#define PAIR_BUDGET 60000 /* epipolar pairs looked at closely in one shot */
#define SURE_VIEW_COUNT 4 /* such a point may claim its blobs at once */
#define CANDIDATE_MAX (POINT_MAX * 4)

double match_sigma_px(const struct matcher *m, const struct blob *blob)
{
	return sqrt((double)blob->sigma_px * blob->sigma_px + m->view_variance_px2);
}

/* One blob per camera that may show one point (BLOB_NONE where there is none), chosen around a
 * guess and with the projections of that guess. */
struct choice {
	struct guess guess;
	int count;
	int16_t blob[CAMERA_MAX];
	struct projection at_guess[CAMERA_MAX]; /* where there is a blob */
};

static bool point_from_choice(const struct matcher *m, const struct choice *choice,
			      struct point *out)
{
	struct sighting sightings[CAMERA_MAX];
	int camera_of[CAMERA_MAX], count = 0;
	struct fix fix;

	for (uint32_t c = 0; c < m->camera_count; c++) {
		if (choice->blob[c] == BLOB_NONE)
			continue;
		const struct blob *b = &m->cameras[c].blobs[choice->blob[c]];
		sightings[count] = (struct sighting){m->cameras[c].view,
						     {b->x_px, b->y_px},
						     match_sigma_px(m, b),
						     b->flags,
						     choice->at_guess[c]};
		camera_of[count++] = (int)c;
	}
	if (count < 2 || triangulate(sightings, count, &choice->guess, &fix))
		return false;
	out->fix = fix;
	out->fix.used_mask = 0;
	out->claimed_mask = 0;
	out->label = LABEL_NONE;
	for (int i = 0; i < count; i++) {
		if (fix.used_mask & (1u << i))
			out->fix.used_mask |= 1u << camera_of[i];
		out->claimed_mask |= 1u << camera_of[i];
		out->blob[camera_of[i]] = choice->blob[camera_of[i]];
	}
	return true;
}

/* Nearest free blob to the projection of p in every camera, within a radius that is given in metres
 * at the point or in pixels, whichever is larger. */
static void choose(const struct matcher *m, struct vec3 p, double radius_m, double radius_px,
		   struct choice *out)
{
	out->guess = (struct guess){p, true};
	out->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		const struct sight_index *camera = &m->cameras[c];
		struct projection *at = &out->at_guess[c];

		out->blob[c] = BLOB_NONE;
		if (!camera->view || !view_project(camera->view, p, at->pixel, at->slopes))
			continue;
		double range_m = vec3_distance(p, camera->view->centre_stage_m);
		double reach_px = radius_m * camera->pixels_per_radian / range_m;
		out->blob[c] = (int16_t)sight_index_nearest(
			camera, at->pixel, reach_px > radius_px ? reach_px : radius_px, true);
		out->count += out->blob[c] != BLOB_NONE;
	}
}

static bool in_range(const struct matcher *m, struct vec3 p, uint32_t camera_mask)
{
	for (uint32_t c = 0; c < m->camera_count; c++) {
		if (!(camera_mask & (1u << c)))
			continue;
		double range_m = vec3_distance(p, m->cameras[c].view->centre_stage_m);
		if (range_m < m->settings->range_min_m || range_m > m->settings->range_max_m)
			return false;
	}
	return true;
}

/* Three views agree by chance more easily than four: they must agree better. */
static bool confirmed(const struct matcher *m, const struct point *point, int least_views)
{
	double gate_px = m->settings->match_gate_px;

	if (point->fix.used_count < least_views)
		return false;
	if (point->fix.used_count <= 3)
		gate_px = fmax(0.5 * gate_px, fmin(gate_px, 4 * sqrt(m->view_variance_px2)));
	return point->fix.residual_px <= gate_px &&
	       in_range(m, point->fix.p_stage_m, point->fix.used_mask);
}

/* The blobs chosen around a guess are those that would be chosen around the solution: it fits them
 * well and moved less than the radius allows. */
static bool choice_stands(const struct matcher *m, const struct point *point, struct vec3 guess,
			  double radius_m)
{
	double gate_px = m->settings->match_gate_px;
	double gate_m =
		gate_px *
		vec3_distance(guess,
			      m->cameras[__builtin_ctz(point->claimed_mask)].view->centre_stage_m) /
		m->cameras[__builtin_ctz(point->claimed_mask)].pixels_per_radian;

	return point->fix.used_mask == point->claimed_mask &&
	       point->fix.residual_px < 0.3 * gate_px &&
	       vec3_distance(guess, point->fix.p_stage_m) + gate_m < radius_m;
}

/* From a first guess to a confirmed point: solve, look again around the solution, solve. */
static bool point_near(const struct matcher *m, struct vec3 p, double radius_m, struct point *out)
{
	struct choice first, again;
	double gate_px = m->settings->match_gate_px;

	choose(m, p, radius_m, gate_px, &first);
	if (first.count < 3 || !point_from_choice(m, &first, out))
		return false;
	if (!choice_stands(m, out, p, radius_m)) {
		choose(m, out->fix.p_stage_m, 0, gate_px, &again);
		if (again.count < 3)
			return false;
		if (memcmp(first.blob, again.blob, m->camera_count * sizeof(first.blob[0])) &&
		    !point_from_choice(m, &again, out))
			return false;
	}
	/* where a marker was expected, two that agree may outvote a third */
	return confirmed(m, out, 2);
}

static void add_candidate(struct matcher *m, const struct point *point)
{
	if (m->candidate_count < CANDIDATE_MAX)
		m->candidates[m->candidate_count++] = *point;
}

static bool better(const struct point *a, const struct point *b)
{
	if (a->fix.used_count != b->fix.used_count)
		return a->fix.used_count > b->fix.used_count;
	return a->fix.residual_px < b->fix.residual_px;
}

/* Shell sort: in place, no recursion, the same order for the same input. */
static void sort_candidates(struct matcher *m)
{
	uint16_t *order = m->candidate_order;
	int count = (int)m->candidate_count;

	for (int i = 0; i < count; i++)
		order[i] = (uint16_t)i;
	for (int gap = count / 2; gap > 0; gap /= 2)
		for (int i = gap; i < count; i++) {
			uint16_t moving = order[i];
			int k = i;

			for (; k >= gap &&
			       better(&m->candidates[moving], &m->candidates[order[k - gap]]);
			     k -= gap)
				order[k] = order[k - gap];
			order[k] = moving;
		}
}

static void claim(struct matcher *m, const struct point *point)
{
	if (m->point_count == POINT_MAX)
		return;
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (point->claimed_mask & (1u << c))
			m->cameras[c].owner[point->blob[c]] = (int16_t)m->point_count;
	m->points[m->point_count++] = *point;
}

/* Drops the views whose blob another point has taken, and solves again with the rest. */
static bool settle(const struct matcher *m, struct point *point)
{
	struct choice left = {.guess = {point->fix.p_stage_m, false}};
	bool changed = false;

	for (uint32_t c = 0; c < m->camera_count; c++) {
		bool wants = point->claimed_mask & (1u << c);

		left.blob[c] = wants ? point->blob[c] : BLOB_NONE;
		if (wants && m->cameras[c].owner[left.blob[c]] >= 0) {
			left.blob[c] = BLOB_NONE;
			changed = true;
		}
	}
	if (!changed)
		return true;
	return point_from_choice(m, &left, point) && confirmed(m, point, 3);
}

static void claim_candidates(struct matcher *m)
{
	sort_candidates(m);
	for (uint32_t i = 0; i < m->candidate_count; i++) {
		struct point *candidate = &m->candidates[m->candidate_order[i]];

		if (settle(m, candidate))
			claim(m, candidate);
	}
	m->candidate_count = 0;
}

void match_begin(struct matcher *m, const struct tracker_rig *rig, double excess_px2,
		 const struct shot *shot)
{
	double calibration_px = rig->settings.calibration_sigma_px;

	m->settings = &rig->settings;
	m->view_variance_px2 = fmax(calibration_px * calibration_px, excess_px2);
	m->camera_count = rig->camera_count;
	m->point_count = 0;
	m->candidate_count = 0;
	for (uint32_t c = 0; c < rig->camera_count; c++) {
		m->cameras[c].view = NULL;
		if (rig->views[c] && shot->sets[c])
			sight_index_build(&m->cameras[c], rig->views[c], shot->sets[c]);
	}
}

void match_seeds(struct matcher *m, const struct seed *seeds, int count)
{
	for (int i = 0; i < count; i++) {
		struct point point;

		if (point_near(m, seeds[i].p_stage_m, seeds[i].radius_m, &point))
			add_candidate(m, &point);
	}
	claim_candidates(m);
}

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

/* A blob of camera a and one of camera b: is there a point that other cameras confirm? */
static void try_pair(struct matcher *m, uint32_t ca, int blob_a, uint32_t cb, int blob_b)
{
	struct vec3 p;
	struct point point;
	struct choice choice;

	if (!rays_meet(&m->cameras[ca], blob_a, &m->cameras[cb], blob_b, &p) ||
	    !in_range(m, p, 1u << ca | 1u << cb))
		return;
	choose(m, p, 0, m->settings->match_gate_px, &choice);
	if (choice.count < 3 || choice.blob[ca] == BLOB_NONE || choice.blob[cb] == BLOB_NONE)
		return;
	choice.blob[ca] = (int16_t)blob_a;
	choice.blob[cb] = (int16_t)blob_b;
	if (!point_from_choice(m, &choice, &point) || !confirmed(m, &point, 3))
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

	for (int i = 0; i < a->blob_count; i++) {
		struct vec3 normal = vec3_unit(vec3_cross(baseline, a->ray[i]));

		for (int j = 0; j < b->blob_count && a->owner[i] < 0; j++) {
			if (b->owner[j] >= 0 || fabs(vec3_dot(normal, b->ray[j])) > gate_rad)
				continue;
			if (budget-- == 0)
				return 0;
			try_pair(m, ca, i, cb, j);
		}
	}
	return budget;
}

void match_leftovers(struct matcher *m)
{
	int budget = PAIR_BUDGET;

	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view)
			sight_index_rays(&m->cameras[c]);
	for (uint32_t a = 0; a < m->camera_count; a++)
		for (uint32_t b = a + 1; b < m->camera_count && budget > 0; b++)
			if (m->cameras[a].view && m->cameras[b].view)
				budget = match_camera_pair(m, a, b, budget);
	claim_candidates(m);
}
