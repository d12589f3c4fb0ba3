/*
 * Candidates are built freely, several may want the same blob; then they claim their blobs in the
 * order of how well they are confirmed: more views first, then the smaller residual.
 */
#include <stdbool.h>
#include <stddef.h>

#include "track/match/match.h"
#include "track/match/match_parts.h"

#define SHORT 32            /* candidates that are sorted one by one */
#define BESIDE_SPREADS2 0.5 /* the square of how far beside, over the spot's variance */

static bool better(const struct point *a, const struct point *b)
{
	return a->fix.residual_px < b->fix.residual_px;
}

/* Shell sort: in place, no recursion, the same order for the same input. */
static void sort_by_residual(const struct matcher *m, uint16_t *order, int count)
{
	for (int gap = count > SHORT ? count / 4 : 1; gap > 0; gap /= 2)
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

/* Those with the most views come first. */
static void sort_candidates(struct matcher *m)
{
	uint16_t from[CAMERA_MAX + 2] = {0}, next[CAMERA_MAX + 1];

	for (uint32_t i = 0; i < m->candidate_count; i++)
		from[CAMERA_MAX - m->candidates[i].fix.used_count + 1]++;
	for (int rank = 0; rank <= CAMERA_MAX; rank++) {
		from[rank + 1] += from[rank];
		next[rank] = from[rank];
	}
	for (uint32_t i = 0; i < m->candidate_count; i++)
		m->candidate_order[next[CAMERA_MAX - m->candidates[i].fix.used_count]++] =
			(uint16_t)i;
	for (int rank = 0; rank <= CAMERA_MAX; rank++)
		sort_by_residual(m, m->candidate_order + from[rank], from[rank + 1] - from[rank]);
}

/* Adds a point that takes its blobs in these cameras. */
static void add_point(struct matcher *m, const struct point *point, uint32_t camera_mask)
{
	if (m->point_count == POINT_MAX)
		return;
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (camera_mask & (1u << c))
			m->cameras[c].owner[point->blob[c]] = (int16_t)m->point_count;
	m->points[m->point_count++] = *point;
}

void claim(struct matcher *m, const struct point *point)
{
	add_point(m, point, point->claimed_mask);
}

/* Whether a blob lies so far beside the point's place that it shows something else alone. */
static bool is_beside(const struct matcher *m, const struct point *point, uint32_t c)
{
	const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];
	double spread_px2 = (double)(blob->shape_px2[0] + blob->shape_px2[2]) / 2, pixel[2];

	if (blob->flags & (BLOB_MERGED | BLOB_EDGE) || merged_is_long(blob) ||
	    !view_project(m->cameras[c].view, point->fix.p_stage_m, pixel, NULL))
		return false;
	double dx = blob->x_px - pixel[0], dy = blob->y_px - pixel[1];
	return spread_px2 > 0 && dx * dx + dy * dy > BESIDE_SPREADS2 * spread_px2;
}

/* The cameras whose blob the point takes before others may. Of two views it is a point by what they
 * outvoted. */
static uint32_t first_claims(const struct matcher *m, const struct point *point)
{
	uint32_t mask = point->claimed_mask;

	if (point->fix.used_count < 3)
		return mask;
	for (uint32_t left = mask & ~point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (is_beside(m, point, c))
			mask &= ~(1u << c);
	}
	return mask;
}

/* The blobs that the point was near and did not use, unless another has them. */
static void claim_unused(struct matcher *m, uint32_t p)
{
	struct point *point = &m->points[p];

	for (uint32_t left = point->claimed_mask & ~point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		int16_t *owner = &m->cameras[c].owner[point->blob[c]];

		if (*owner < 0)
			*owner = (int16_t)p;
		else if (*owner != (int16_t)p)
			point->claimed_mask &= ~(1u << c);
	}
}

/* Of all points from that one on; returns how many points there are. */
static uint32_t claim_all_unused(struct matcher *m, uint32_t from)
{
	for (uint32_t p = from; p < m->point_count; p++)
		claim_unused(m, p);
	return m->point_count;
}

/* Drops the views whose blob another point has taken, and solves again with the rest. */
static bool settle(const struct matcher *m, struct point *point)
{
	struct choice left = {.guess_stage_m = point->fix.p_stage_m,
			      .seed = -1,
			      .outvoted_mask = point->outvoted_mask};
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
	return point_from_choice(m, &left, point) && point_confirmed(m, point, 3);
}

void claim_candidates(struct matcher *m)
{
	uint32_t unshared = m->point_count;

	sort_candidates(m);
	for (uint32_t i = 0; i < m->candidate_count; i++) {
		struct point *candidate = &m->candidates[m->candidate_order[i]];

		if (candidate->fix.used_count < 3) /* those may only take what is left */
			unshared = claim_all_unused(m, unshared);
		if (settle(m, candidate))
			add_point(m, candidate, first_claims(m, candidate));
	}
	claim_all_unused(m, unshared);
	m->candidate_count = 0;
}
