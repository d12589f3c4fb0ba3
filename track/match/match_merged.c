/*
 * Spots that are two markers: a long one where two markers are expected is parted into two sights,
 * by its spread along the line between them and by how bright either one was when last seen alone.
 */
#include <string.h>

#include "track/blobs/blob_axes.h"
#include "track/match/match_parts.h"
#include "track/match/sight_index.h"

#define LONG_SHARE 0.25     /* the axes differ by this share of their mean, either way ... */
#define LONG_PX2 0.5        /* ... and by so much: no marker seen obliquely */
#define NEAR_MAX 6          /* markers expected about one spot */
#define REACH_SPREADS 2.2   /* of the spot: its markers are expected this near to its middle */
#define ALONG_COSINE 0.85   /* of the spot's long axis with the line between the two */
#define OWN_SHARE 0.06f     /* of its spread: as an axis may differ from when it was alone */
#define PART_OFF_PX 1.5     /* a part lies this near to where its marker is expected */
#define TAIL_GAIN 1.28      /* what the threshold cuts off two spots' spread */
#define PULL 1.4            /* a window is drawn to the brighter one, more than the mean is */
#define SHARE_MIN 0.2       /* of the light that one of two has; less is not seen as two */
#define PART_SIGMA_PX 0.22  /* of a part whose share of the light is known ... */
#define BLIND_SIGMA_PX 0.35 /* ... or is not, clipped as it is or never seen alone */
#define PEAK_CLIPPED 235
#define APART_SPREADS 3.0 /* of either one: two markers farther apart are two spots */

/* What is expected about one spot of a camera. */
struct merged {
	const struct blob *blob;
	struct blob_axes axes;
	int count;
	int16_t seed[NEAR_MAX];
};

bool merged_is_long(const struct blob *blob)
{
	double xx = blob->shape_px2[0], xy = blob->shape_px2[1], yy = blob->shape_px2[2];
	double half2 = 0.25 * (xx - yy) * (xx - yy) + xy * xy, mean = 0.5 * (xx + yy);

	return half2 > LONG_SHARE * LONG_SHARE * mean * mean && 4 * half2 > LONG_PX2 * LONG_PX2;
}

static double distance2_px2(const double a[2], const double b[2])
{
	return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

static void find_expected(const struct matcher *m, uint32_t c, struct merged *merged)
{
	const double at_px[2] = {merged->blob->x_px, merged->blob->y_px};
	double reach2_px2 = REACH_SPREADS * REACH_SPREADS * merged->axes.major_px2;

	merged->count = 0;
	for (int i = 0; i < m->seed_count && merged->count < NEAR_MAX; i++)
		if (m->seeds[i].label != LABEL_NONE && m->in_sight[c][i] &&
		    distance2_px2(m->seen[c][i].pixel, at_px) < reach2_px2)
			merged->seed[merged->count++] = (int16_t)i;
}

bool merged_share(const struct tracker_state *state, const struct matcher *m, uint32_t c,
		  const int16_t seed[2], double *share)
{
	double one = state->looks[m->seeds[seed[0]].label].peak[c];
	double other = state->looks[m->seeds[seed[1]].label].peak[c];
	bool known = one > 0 && other > 0 && one < PEAK_CLIPPED && other < PEAK_CLIPPED;

	*share = known ? fmin(fmax(other / (one + other), SHARE_MIN), 1 - SHARE_MIN) : 0.5;
	return known;
}

double merged_excess_px2(double longer_px2)
{
	return TAIL_GAIN * longer_px2;
}

double merged_sigma_px(bool share_known)
{
	return share_known ? PART_SIGMA_PX : BLIND_SIGMA_PX;
}

double merged_drawn_px(double share, double apart_px)
{
	return PULL * (share - 0.5) * apart_px;
}

double merged_share_drawn(double drawn_px, double apart_px)
{
	return fmin(fmax(0.5 + drawn_px / (PULL * apart_px), SHARE_MIN), 1 - SHARE_MIN);
}

void merged_place(const struct blob *blob, const double along[2], double apart_px, double share,
		  struct parting *out)
{
	double middle_px = -merged_drawn_px(share, apart_px);

	for (int i = 0; i < 2; i++) {
		double at_px = middle_px + (i ? 0.5 : -0.5) * apart_px;

		out->part_px[i][0] = blob->x_px + at_px * along[0];
		out->part_px[i][1] = blob->y_px + at_px * along[1];
	}
}

/* Another spot lies nearer to where a marker is expected than its part of this one. */
static bool has_own_spot(const struct sight_index *camera, const struct blob *merged,
			 const double expected_px[2], double part_off2_px2)
{
	for (int k = 0; k < camera->blob_count; k++) {
		const struct blob *blob = &camera->blobs[k];
		double at_px[2] = {blob->x_px, blob->y_px};

		if (blob != merged && distance2_px2(at_px, expected_px) < part_off2_px2)
			return true;
	}
	return false;
}

/* The camera saw the seed's marker lately: else it is hidden from it rather than in a spot. */
static bool sees(const struct matcher *m, uint32_t c, const struct tracker_state *state, int seed)
{
	return state->looks[m->seeds[seed].label].sees[c] >= LOOK_SEES_LEAST;
}

/* The spot parted between these two markers, if it fits them. */
static bool part_between(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			 const struct merged *merged, const int16_t seed[2], struct parting *out)
{
	const double *one_px = m->seen[c][seed[0]].pixel, *other_px = m->seen[c][seed[1]].pixel;
	double along[2] = {cos(merged->axes.angle_rad), sin(merged->axes.angle_rad)};
	double line[2] = {other_px[0] - one_px[0], other_px[1] - one_px[1]};
	double projected_px = line[0] * along[0] + line[1] * along[1], share;
	bool known = merged_share(state, m, c, seed, &share);
	double excess_px2 = merged_excess_px2(merged->axes.major_px2 - merged->axes.minor_px2);
	double apart_px = copysign(sqrt(excess_px2 / (share * (1 - share))), projected_px);

	if (!sees(m, c, state, seed[0]) || !sees(m, c, state, seed[1]) ||
	    fabs(projected_px) < ALONG_COSINE * hypot(line[0], line[1]) ||
	    fabs(apart_px) > APART_SPREADS * sqrt(merged->axes.minor_px2))
		return false;
	out->cost_px2 = 0;
	out->kind = HALF_LONG;
	out->sigma_px = merged_sigma_px(known);
	for (int i = 0; i < 2; i++)
		out->label[i] = m->seeds[seed[i]].label;
	merged_place(merged->blob, along, apart_px, share, out);
	for (int i = 0; i < 2; i++) {
		const double *expected_px = i ? other_px : one_px;

		double off2_px2 = distance2_px2(out->part_px[i], expected_px);
		if (off2_px2 > PART_OFF_PX * PART_OFF_PX ||
		    has_own_spot(&m->cameras[c], merged->blob, expected_px, off2_px2))
			return false;
		out->cost_px2 += off2_px2;
	}
	return true;
}

/* Whether two markers at least are expected here that have no nearer spot. */
static bool is_shared(const struct matcher *m, uint32_t c, const struct merged *merged)
{
	const double at_px[2] = {merged->blob->x_px, merged->blob->y_px};
	int count = 0;

	for (int i = 0; i < merged->count; i++) {
		const double *expected_px = m->seen[c][merged->seed[i]].pixel;

		count += !has_own_spot(&m->cameras[c], merged->blob, expected_px,
				       distance2_px2(at_px, expected_px));
	}
	return count >= 2;
}

/* One of those that are expected here looked like this spot when the camera last saw it alone. */
static bool is_ones_own(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			const struct merged *merged)
{
	const double at_px[2] = {merged->blob->x_px, merged->blob->y_px};
	const float *shape_px2 = merged->blob->shape_px2;

	for (int i = 0; i < merged->count; i++) {
		int seed = merged->seed[i];
		const float *own_px2 = state->looks[m->seeds[seed].label].shape_px2[c];
		float most_px2 = OWN_SHARE * (own_px2[0] + own_px2[2]);

		if (own_px2[0] > 0 && fabsf(shape_px2[0] - own_px2[0]) < most_px2 &&
		    2 * fabsf(shape_px2[1] - own_px2[1]) < most_px2 &&
		    fabsf(shape_px2[2] - own_px2[2]) < most_px2 &&
		    distance2_px2(m->seen[c][seed].pixel, at_px) < PART_OFF_PX * PART_OFF_PX)
			return true;
	}
	return false;
}

static enum merge find_parting(const struct matcher *m, uint32_t c,
			       const struct tracker_state *state, const struct blob *blob,
			       struct parting *best)
{
	struct merged merged = {.blob = blob};

	*best = (struct parting){.cost_px2 = INFINITY};
	if (!merged_is_long(blob) || blob->flags & BLOB_EDGE || !blob_axes(blob, &merged.axes))
		return MERGE_NONE;
	find_expected(m, c, &merged);
	if (is_ones_own(m, c, state, &merged))
		return MERGE_NONE;
	for (int i = 0; i < merged.count; i++)
		for (int j = i + 1; j < merged.count; j++) {
			int16_t pair[2] = {merged.seed[i], merged.seed[j]};
			struct parting parting;

			if (part_between(m, c, state, &merged, pair, &parting) &&
			    parting.cost_px2 < best->cost_px2)
				*best = parting;
		}
	if (best->cost_px2 < INFINITY)
		return MERGE_PARTED;
	best->sigma_px = sqrt(merged.axes.major_px2 - merged.axes.minor_px2);
	return is_shared(m, c, &merged) ? MERGE_VAGUE : MERGE_NONE;
}

static struct blob part_of(const struct blob *blob, const struct parting *parting, int which)
{
	struct blob part = *blob;
	float round_px2 = fminf(blob->shape_px2[0], blob->shape_px2[2]);

	part.x_px = (float)parting->part_px[which][0];
	part.y_px = (float)parting->part_px[which][1];
	part.sigma_px = hypotf(blob->sigma_px, (float)parting->sigma_px);
	part.area_px2 = blob->area_px2 / 2;
	part.flags |= BLOB_MERGED;
	part.shape_px2[0] = part.shape_px2[2] = round_px2;
	part.shape_px2[1] = 0;
	return part;
}

/* A camera's blobs while some of them are parted: a copy, once there is any. */
struct parted {
	const struct sight_index *camera;
	struct blob *blobs;
	int16_t *other_half, *part_label;
	uint8_t *half_kind;
	int count; /* 0: none is parted yet */
	bool done[BLOB_MAX];
};

static struct blob *write_to(struct parted *parted, int blob)
{
	if (parted->count == 0) {
		parted->count = parted->camera->blob_count;
		memcpy(parted->blobs, parted->camera->blobs,
		       (size_t)parted->count * sizeof(*parted->blobs));
		for (int k = 0; k < parted->count; k++)
			parted->other_half[k] = BLOB_NONE;
	}
	parted->done[blob] = true;
	return &parted->blobs[blob];
}

/* A spot is parted once: what is known first of it holds. */
static void take_merge(struct parted *parted, int blob, enum merge merge,
		       const struct parting *parting)
{
	if (merge == MERGE_NONE || parted->done[blob])
		return;
	struct blob *one = write_to(parted, blob);

	if (merge == MERGE_VAGUE || parted->count == BLOB_MAX) {
		one->sigma_px = hypotf(one->sigma_px, (float)parting->sigma_px);
		one->flags |= BLOB_MERGED;
		return;
	}
	parted->other_half[blob] = (int16_t)parted->count;
	parted->other_half[parted->count] = (int16_t)blob;
	parted->half_kind[blob] = parted->half_kind[parted->count] = (uint8_t)parting->kind;
	parted->part_label[blob] = parting->label[0];
	parted->part_label[parted->count] = parting->label[1];
	parted->blobs[parted->count++] = part_of(&parted->camera->blobs[blob], parting, 1);
	*one = part_of(&parted->camera->blobs[blob], parting, 0);
}

static void part_pressed(const struct matcher *m, uint32_t c, const struct tracker_state *state,
			 const struct pressed *pressed, int count, struct parted *parted)
{
	for (int i = 0; i < count; i++) {
		struct parting parting;
		int blob = BLOB_NONE;
		enum merge merge = pressed_part(m, c, state, &pressed[i], &blob, &parting);

		take_merge(parted, blob, merge, &parting);
	}
}

static void part_long(const struct matcher *m, uint32_t c, const struct tracker_state *state,
		      struct parted *parted)
{
	for (int k = 0; k < parted->camera->blob_count; k++) {
		struct parting parting;

		if (!parted->done[k])
			take_merge(parted, k,
				   find_parting(m, c, state, &parted->camera->blobs[k], &parting),
				   &parting);
	}
}

void match_part_merged(struct matcher *m, const struct tracker_state *state)
{
	struct pressed pressed[PRESSED_MAX];
	int pressed_count = pressed_find(m, state, pressed);

	for (uint32_t c = 0; c < m->camera_count; c++) {
		struct sight_index *camera = &m->cameras[c];
		struct parted parted = {.camera = camera,
					.blobs = m->parted[c],
					.other_half = m->other_half[c],
					.part_label = m->part_label[c],
					.half_kind = m->half_kind[c]};

		if (!camera->view)
			continue;
		part_pressed(m, c, state, pressed, pressed_count, &parted);
		part_long(m, c, state, &parted);
		if (parted.count)
			sight_index_build(camera, camera->view, m->parted[c], parted.count);
	}
}
