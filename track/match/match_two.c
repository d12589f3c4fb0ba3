/*
 * A marker that only two cameras see: nothing confirms the pair but the place where it is expected,
 * so the pair must be the only one there.
 */
#include <string.h>

#include "track/match/match_parts.h"
#include "track/match/sight_index.h"

#define NEAR_MAX 6            /* blobs looked at per camera */
#define RIVAL_FACTOR 2.0      /* a second pair must be this much farther away */
#define CHI2_MAX 12.0         /* the two rays must meet as well as their spots are known */
#define PARALLAX_MIN 0.05     /* sine of the angle between the rays */
#define OPPOSED_COSINE (-0.8) /* of it: a disc is not seen from both its sides */

struct near_blobs {
	int count;
	int16_t blob[NEAR_MAX];
};

struct pair {
	struct point point;
	double distance_m; /* from the seed */
};

static bool pair_point(const struct matcher *m, struct vec3 guess_stage_m, uint32_t ca, int blob_a,
		       uint32_t cb, int blob_b, struct point *out)
{
	const uint32_t cameras[2] = {ca, cb};
	int blobs[2] = {blob_a, blob_b};
	struct sighting sightings[2];

	for (int i = 0; i < 2; i++) {
		const struct sight_index *camera = &m->cameras[cameras[i]];
		const struct blob *b = &camera->blobs[blobs[i]];

		sightings[i] = (struct sighting){camera->view,
						 {b->x_px, b->y_px},
						 match_sigma_px(m, cameras[i], b),
						 b->flags,
						 false,
						 NULL};
	}
	if (triangulate(sightings, 2, &guess_stage_m, &out->fix) ||
	    out->fix.residual_px > 0.5 * m->settings->match_gate_px ||
	    out->fix.chi2_per_dof > CHI2_MAX)
		return false;
	out->claimed_mask = out->fix.used_mask = 1u << ca | 1u << cb;
	out->blob[ca] = (int16_t)blob_a;
	out->blob[cb] = (int16_t)blob_b;
	out->label = LABEL_NONE;
	out->outvoted_mask = 0;
	return true;
}

/* Halves of parted spots that are other labels'. */
static void drop_others(const struct matcher *m, uint32_t c, int label, struct near_blobs *near)
{
	int kept = 0;

	for (int i = 0; i < near->count; i++)
		if (match_may_show(m, c, near->blob[i], label))
			near->blob[kept++] = near->blob[i];
	near->count = kept;
}

static void find_near(const struct matcher *m, const struct seed *seed,
		      struct near_blobs near[CAMERA_MAX])
{
	int index = seed->label == LABEL_NONE ? -1 : m->seed_of_label[seed->label];

	for (uint32_t c = 0; c < m->camera_count; c++) {
		const struct sight_index *camera = &m->cameras[c];
		double pixel[2];

		near[c].count = 0;
		if (!camera->view || !project_near(m, c, seed->p_stage_m, index, pixel))
			continue;
		double range_m = vec3_distance(seed->p_stage_m, camera->view->centre_stage_m);
		double radius_px = seed->radius_m * camera->pixels_per_radian / range_m + 1;
		near[c].count =
			sight_index_within(camera, pixel, radius_px, near[c].blob, NEAR_MAX);
		drop_others(m, c, seed->label, &near[c]);
	}
}

/* Whether two cameras can see the same disc there, and under an angle that tells its place. */
static bool can_share(const struct matcher *m, struct vec3 p, uint32_t ca, uint32_t cb)
{
	struct vec3 a = vec3_unit(vec3_sub(p, m->cameras[ca].view->centre_stage_m));
	struct vec3 b = vec3_unit(vec3_sub(p, m->cameras[cb].view->centre_stage_m));

	return vec3_norm(vec3_cross(a, b)) >= PARALLAX_MIN && vec3_dot(a, b) > OPPOSED_COSINE;
}

/* Keeps the nearest pair in best[0] and its nearest rival in best[1]. */
static void weigh_cameras(const struct matcher *m, const struct seed *seed,
			  const struct near_blobs near[CAMERA_MAX], uint32_t ca, uint32_t cb,
			  struct pair best[2])
{
	if (near[ca].count == 0 || near[cb].count == 0 || !can_share(m, seed->p_stage_m, ca, cb))
		return;
	for (int i = 0; i < near[ca].count; i++)
		for (int j = 0; j < near[cb].count; j++) {
			struct pair pair;

			if (!pair_point(m, seed->p_stage_m, ca, near[ca].blob[i], cb,
					near[cb].blob[j], &pair.point))
				continue;
			pair.distance_m = vec3_distance(pair.point.fix.p_stage_m, seed->p_stage_m);
			if (pair.distance_m < best[0].distance_m) {
				best[1] = best[0];
				best[0] = pair;
			} else if (pair.distance_m < best[1].distance_m) {
				best[1] = pair;
			}
		}
}

static int add_pair(struct matcher *m, const struct point *point)
{
	claim(m, point);
	m->points[m->point_count - 1].is_pressed = match_is_pressed(m, point);
	return (int)m->point_count - 1;
}

int match_two_cameras(struct matcher *m, const struct seed *seed)
{
	struct near_blobs near[CAMERA_MAX];
	struct pair best[2] = {{.distance_m = seed->radius_m}, {.distance_m = INFINITY}};

	if (m->point_count == POINT_MAX)
		return -1;
	find_near(m, seed, near);
	for (uint32_t a = 0; a < m->camera_count; a++)
		for (uint32_t b = a + 1; b < m->camera_count; b++)
			weigh_cameras(m, seed, near, a, b, best);
	if (!(best[0].distance_m < seed->radius_m) ||
	    best[1].distance_m < RIVAL_FACTOR * best[0].distance_m)
		return -1;
	return add_pair(m, &best[0].point);
}

int match_across(const struct matcher *m, const struct point *point)
{
	uint32_t c = (uint32_t)__builtin_ctz(point->fix.used_mask);

	return m->part_label[c][m->other_half[c][point->blob[c]]];
}

int match_other_halves(struct matcher *m, int point)
{
	const struct point *one = &m->points[point];
	uint32_t ca = (uint32_t)__builtin_ctz(one->fix.used_mask);
	uint32_t cb = 31 - (uint32_t)__builtin_clz(one->fix.used_mask);
	int blob_a = m->other_half[ca][one->blob[ca]], blob_b = m->other_half[cb][one->blob[cb]];
	struct point other;

	if (m->point_count == POINT_MAX || m->part_label[ca][blob_a] != m->part_label[cb][blob_b] ||
	    m->cameras[ca].owner[blob_a] >= 0 || m->cameras[cb].owner[blob_b] >= 0 ||
	    !pair_point(m, one->fix.p_stage_m, ca, blob_a, cb, blob_b, &other))
		return -1;
	return add_pair(m, &other);
}

void match_give_back(struct matcher *m)
{
	const struct point *last = &m->points[--m->point_count];

	for (uint32_t c = 0; c < m->camera_count; c++)
		if (last->claimed_mask & (1u << c))
			m->cameras[c].owner[last->blob[c]] = -1;
}
