/*
 * Which spot of a camera is both of two lips' or lids' markers, and what its spread says of the way
 * from one to the other; and which camera has a spot for each.
 */
#include "track/match/match_pressed_parts.h"
#include "track/match/sight_index.h"

#define LINE_MIN_PX 0.7  /* so far apart at least, in a camera that may tell */
#define OFF_SHARE 0.4    /* of that: so far from the middle is their spot, and ... */
#define OFF_PX 0.8       /* ... so much more, as neither is expected exactly */
#define OTHERS_SHARE 0.7 /* of how far it is: others that are nearer have a better claim */
#define WAY_SIGMA_PX 0.1 /* of spots that touch, beyond their own */

static bool are_in_sight(const struct matcher *m, uint32_t c, const int16_t seed[2])
{
	return m->cameras[c].view && m->in_sight[c][seed[0]] && m->in_sight[c][seed[1]];
}

static double length_px(const struct projection *q, struct vec3 way_m)
{
	return hypot(project_slope(q, 0, way_m), project_slope(q, 1, way_m));
}

/* The camera's spots nearest to where the two are expected, within so much of the line. */
static void find_nearest(const struct matcher *m, uint32_t c, const int16_t seed[2],
			 double reach_px, int blob[2])
{
	for (int i = 0; i < 2; i++)
		blob[i] = sight_index_nearest(&m->cameras[c], m->seen[c][seed[i]].pixel, reach_px);
}

static double off2_px2(const struct blob *blob, double x_px, double y_px)
{
	double x = blob->x_px - x_px, y = blob->y_px - y_px;

	return x * x + y * y;
}

/* Another marker, or another two, are expected nearer to the spot than that. */
static bool is_of_others(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			 const int16_t seed[2], const struct blob *blob, double near2_px2)
{
	for (int i = 0; i < m->seed_count; i++) {
		int label = m->seeds[i].label;
		const double *at_px = m->seen[c][i].pixel;

		if (label == LABEL_NONE || i == seed[0] || i == seed[1] || !m->in_sight[c][i])
			continue;
		if (off2_px2(blob, at_px[0], at_px[1]) < near2_px2)
			return true;
		int other = state->labels[label].below < 0
				    ? -1
				    : m->seed_of_label[state->labels[label].below];
		if (other < 0 || !m->in_sight[c][other])
			continue;
		const double *other_px = m->seen[c][other].pixel;
		if (off2_px2(blob, (at_px[0] + other_px[0]) / 2, (at_px[1] + other_px[1]) / 2) <
		    near2_px2)
			return true;
	}
	return false;
}

/* Their one spot, if the camera has no better one for either, nor others a better claim to it. */
static int blob_of_both(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			const int16_t seed[2], double line_px)
{
	const struct sight_index *camera = &m->cameras[c];
	const double *one_px = m->seen[c][seed[0]].pixel, *other_px = m->seen[c][seed[1]].pixel;
	double middle_px[2] = {(one_px[0] + other_px[0]) / 2, (one_px[1] + other_px[1]) / 2};
	double reach_px = OFF_SHARE * line_px + OFF_PX;
	int blob = sight_index_nearest(camera, middle_px, reach_px), nearest[2];

	find_nearest(m, c, seed, reach_px, nearest);
	for (int i = 0; i < 2; i++)
		if (nearest[i] != blob && nearest[i] != BLOB_NONE)
			return BLOB_NONE;
	if (blob == BLOB_NONE || camera->blobs[blob].flags & BLOB_EDGE)
		return BLOB_NONE;
	double own_px2 = off2_px2(&camera->blobs[blob], middle_px[0], middle_px[1]);
	bool theirs = !is_of_others(m, c, state, seed, &camera->blobs[blob],
				    OTHERS_SHARE * OTHERS_SHARE * own_px2);
	return theirs ? blob : BLOB_NONE;
}

/* What the spot's spread has beyond that of its two as each was when it was last alone. */
static void find_excess(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			const int16_t seed[2], const float shape_px2[3], struct pressed_spot *out)
{
	const float *one_px2 = state->looks[m->seeds[seed[0]].label].shape_px2[c];
	const float *other_px2 = state->looks[m->seeds[seed[1]].label].shape_px2[c];
	double more_px2[3];

	out->alone_known = one_px2[0] > 0 && other_px2[0] > 0;
	for (int k = 0; k < 3; k++) {
		double own_px2 = out->alone_known ? (1 - out->share) * (double)one_px2[k] +
							    out->share * (double)other_px2[k]
						  : 0;
		more_px2[k] = merged_excess_px2((double)shape_px2[k] - own_px2) /
			      (out->share * (1 - out->share));
	}
	out->longer_px2[0] = more_px2[0] - more_px2[2];
	out->longer_px2[1] = 2 * more_px2[1];
	out->longer_px2[2] = more_px2[0] + more_px2[2];
}

/* Looked for as far off as the way was expected to be long: what is found once is found again when
 * the way has turned out shorter. */
bool pressed_find_spot(const struct matcher *m, uint32_t c, const struct tracker_state *state,
		       const struct pressed *pressed, struct pressed_spot *out)
{
	const int16_t *seed = pressed->seed;

	if (!are_in_sight(m, c, seed))
		return false;
	for (int k = 0; k < 2; k++)
		out->line[k] = project_slope(&m->seen[c][seed[0]], k, pressed->apart_m);
	out->line_px = hypot(out->line[0], out->line[1]);
	out->blob = blob_of_both(
		m, c, state, seed,
		fmax(out->line_px, length_px(&m->seen[c][seed[0]], pressed->expected_m)));
	if (out->blob == BLOB_NONE)
		return false;
	const float *shape_px2 = m->cameras[c].blobs[out->blob].shape_px2;
	out->share_known = merged_share(state, m, c, seed, &out->share);
	find_excess(m, c, state, seed, shape_px2, out);
	return shape_px2[0] > 0;
}

bool pressed_spot_tells(const struct pressed_spot *spot)
{
	return spot->line_px >= LINE_MIN_PX;
}

void pressed_find_spots(const struct matcher *m, const struct tracker_state *state,
			const struct pressed *pressed, struct pressed_spots *spots)
{
	spots->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		struct pressed_spot *spot = &spots->spot[spots->count];

		if (pressed_find_spot(m, c, state, pressed, spot) && pressed_spot_tells(spot))
			spots->camera[spots->count++] = c;
	}
}

/* Neither spot is more likely other markers'. */
static bool are_theirs(const struct matcher *m, uint32_t c, const struct tracker_state *state,
		       const int16_t seed[2], const int blob[2])
{
	for (int i = 0; i < 2; i++) {
		const struct blob *spot = &m->cameras[c].blobs[blob[i]];
		const double *at_px = m->seen[c][seed[i]].pixel;
		double own_px2 = off2_px2(spot, at_px[0], at_px[1]);

		if (is_of_others(m, c, state, seed, spot, OTHERS_SHARE * OTHERS_SHARE * own_px2))
			return false;
	}
	return true;
}

/* The camera has a spot for each, and so tells the way from one to the other. They touch: where
 * they do not, a camera that has but one spot sees one of them alone. */
static void find_way(const struct matcher *m, uint32_t c, const struct tracker_state *state,
		     const struct pressed *pressed, struct pressed_spots *out)
{
	double line_px = length_px(&m->seen[c][pressed->seed[0]], pressed->apart_m);
	int blob[2];

	find_nearest(m, c, pressed->seed, OFF_SHARE * line_px, blob);
	if (blob[0] == BLOB_NONE || blob[1] == BLOB_NONE || blob[0] == blob[1])
		return;
	const struct blob *one = &m->cameras[c].blobs[blob[0]],
			  *other = &m->cameras[c].blobs[blob[1]];
	if (!(one->flags & other->flags & BLOB_MERGED) ||
	    !are_theirs(m, c, state, pressed->seed, blob))
		return;
	out->apart_mask |= 1u << c;
	out->apart_px[c][0] = other->x_px - one->x_px;
	out->apart_px[c][1] = other->y_px - one->y_px;
	out->apart_sigma_px[c] =
		hypot(match_sigma_px(m, c, one), match_sigma_px(m, c, other)) + WAY_SIGMA_PX;
}

void pressed_find_ways(const struct matcher *m, const struct tracker_state *state,
		       const struct pressed *pressed, struct pressed_spots *spots)
{
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (are_in_sight(m, c, pressed->seed))
			find_way(m, c, state, pressed, spots);
}
