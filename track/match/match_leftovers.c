/*
 * Blobs that no seed explains. For each one, the cameras that have a blob in its epipolar plane are
 * found; two such cameras at least must agree with it on a point.
 */
#include <stddef.h>

#include "track/match/match_parts.h"
#include "track/match/sight_index.h"

/* For one shot: images full of garbage may not hold up those that follow. */
#define LOOK_BUDGET 16000000 /* blobs held against an epipolar plane */
#define PAIR_BUDGET 8000     /* pairs of blobs looked at closely */
#define SURE_VIEW_COUNT 4    /* such a point may claim its blobs at once */
#define PARTNER_MAX \
	64 /* of one blob in one camera; a true one beyond is found from its other views */

struct budget {
	int looks, pairs;
};

/* The blobs in the epipolar planes of one blob. */
struct partners {
	uint32_t camera_mask; /* that have any */
	int count[CAMERA_MAX];
	int16_t place[CAMERA_MAX][PARTNER_MAX]; /* in the camera's list of free ones */
};

static struct vec3 ray_at(const struct sight_index *camera, int place)
{
	return (struct vec3){camera->ray_x[place], camera->ray_y[place], camera->ray_z[place]};
}

/* The middle of the shortest line between two rays; false when they do not meet in front. */
static bool rays_meet(const struct sight_index *a, struct vec3 da, const struct sight_index *b,
		      struct vec3 db, struct vec3 *out)
{
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

/* Nearest free blob to p within the gate, in the cameras of the mask. */
static void choose_around(const struct matcher *m, struct vec3 p, uint32_t camera_mask,
			  struct choice *out)
{
	out->guess_stage_m = p;
	out->seed = -1;
	out->outvoted_mask = 0;
	out->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++)
		out->blob[c] = BLOB_NONE;
	for (uint32_t left = camera_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		double pixel[2];

		if (view_project(m->cameras[c].view, p, pixel, NULL))
			out->blob[c] = (int16_t)sight_index_nearest(&m->cameras[c], pixel,
								    m->settings->match_gate_px);
		out->count += out->blob[c] != BLOB_NONE;
	}
}

/* A blob of camera a and one of camera b: is there a point that other cameras confirm? */
static void try_pair(struct matcher *m, uint32_t ca, int place_a, uint32_t cb, int place_b,
		     uint32_t camera_mask)
{
	const struct sight_index *a = &m->cameras[ca], *b = &m->cameras[cb];
	uint32_t pair_mask = 1u << ca | 1u << cb;
	struct vec3 p;
	struct point point;
	struct choice choice;

	if (!rays_meet(a, ray_at(a, place_a), b, ray_at(b, place_b), &p) ||
	    !point_in_range(m, p, pair_mask))
		return;
	choose_around(m, p, camera_mask & ~pair_mask, &choice);
	if (choice.count == 0)
		return;
	choice.blob[ca] = a->free[place_a];
	choice.blob[cb] = b->free[place_b];
	if (!point_from_choice(m, &choice, &point) || !point_confirmed(m, &point, 3))
		return;
	if (point.fix.used_count >= SURE_VIEW_COUNT &&
	    point.fix.residual_px < 0.25 * m->settings->match_gate_px)
		claim(m, &point);
	else
		add_candidate(m, &point);
}

/* Of a ray of camera a, as camera b needs it. */
struct epipolar_plane {
	float x, y, z; /* normal */
	float gate_rad;
};

static struct epipolar_plane plane_of(const struct matcher *m, const struct sight_index *a,
				      struct vec3 ray, const struct sight_index *b)
{
	struct vec3 baseline = vec3_sub(b->view->centre_stage_m, a->view->centre_stage_m);
	struct vec3 normal = vec3_unit(vec3_cross(baseline, ray));

	return (struct epipolar_plane){
		(float)normal.x, (float)normal.y, (float)normal.z,
		(float)(m->settings->match_gate_px *
			(1 / a->pixels_per_radian + 1 / b->pixels_per_radian))};
}

/* The free blobs of camera b in the plane. */
static void find_partners(const struct matcher *m, struct epipolar_plane plane, uint32_t cb,
			  struct partners *out)
{
	const struct sight_index *b = &m->cameras[cb];
	float off[BLOB_MAX];

	for (int j = 0; j < b->free_count; j++)
		off[j] = fabsf(plane.x * b->ray_x[j] + plane.y * b->ray_y[j] +
			       plane.z * b->ray_z[j]);
	out->count[cb] = 0;
	for (int j = 0; j < b->free_count && out->count[cb] < PARTNER_MAX; j++)
		if (off[j] <= plane.gate_rad && b->owner[b->free[j]] < 0)
			out->place[cb][out->count[cb]++] = (int16_t)j;
	if (out->count[cb])
		out->camera_mask |= 1u << cb;
}

static void find_all_partners(const struct matcher *m, uint32_t ca, int place, struct partners *out,
			      struct budget *budget)
{
	const struct sight_index *a = &m->cameras[ca];
	struct vec3 ray = ray_at(a, place);
	struct epipolar_plane planes[CAMERA_MAX];

	out->camera_mask = 1u << ca;
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view && c != ca)
			planes[c] = plane_of(m, a, ray, &m->cameras[c]);
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view && c != ca) {
			find_partners(m, planes[c], c, out);
			budget->looks -= m->cameras[c].free_count;
		}
}

/* Pairs a free blob of camera a with its partners in the cameras behind a; those before have been
 * paired with it already. */
static void match_blob(struct matcher *m, uint32_t ca, int place, struct budget *budget)
{
	const struct sight_index *a = &m->cameras[ca];
	struct partners partners;

	find_all_partners(m, ca, place, &partners, budget);
	if (__builtin_popcount(partners.camera_mask) < 3)
		return;
	for (uint32_t b = ca + 1; b < m->camera_count; b++) {
		bool has_any = partners.camera_mask >> b & 1;

		for (int k = 0; has_any && k < partners.count[b]; k++) {
			int place_b = partners.place[b][k];

			if (a->owner[a->free[place]] >= 0 || budget->pairs <= 0)
				return;
			if (m->cameras[b].owner[m->cameras[b].free[place_b]] >= 0)
				continue;
			budget->pairs--;
			try_pair(m, ca, place, b, place_b, partners.camera_mask);
		}
	}
}

static void match_camera(struct matcher *m, uint32_t ca, struct budget *budget)
{
	const struct sight_index *a = &m->cameras[ca];

	for (int i = 0; i < a->free_count && budget->looks > 0 && budget->pairs > 0; i++)
		if (a->owner[a->free[i]] < 0)
			match_blob(m, ca, i, budget);
}

void match_leftovers(struct matcher *m)
{
	struct budget budget = {LOOK_BUDGET, PAIR_BUDGET};

	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view)
			sight_index_list_free(&m->cameras[c]);
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view)
			sight_index_aim_free(&m->cameras[c]);
	for (uint32_t a = 0; a < m->camera_count; a++) {
		if (!m->cameras[a].view)
			continue;
		match_camera(m, a, &budget);
		for (uint32_t c = 0; c < m->camera_count; c++)
			if (m->cameras[c].view)
				sight_index_trim_free(&m->cameras[c]);
	}
	claim_candidates(m);
}
