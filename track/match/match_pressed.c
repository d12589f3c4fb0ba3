/*
 * Lips and lids that meet: an upper marker and the one across below it, whose light runs into one
 * spot in most cameras. From one to the other it is as far for all of them, so that their spots
 * together tell it, where each one's is too short to be told from a disc seen obliquely.
 */
#include "track/match/match_pressed_parts.h"
#include "track/match/sight_index.h"

#define NEAR_M 0.006      /* so far apart at most are they expected */
#define LINE_MIN_PX 0.7   /* ... and at least, in a camera that may tell */
#define OFF_SHARE 0.4     /* of that: so far from the middle is their spot, and ... */
#define OFF_PX 0.8        /* ... so much more, as neither is expected exactly */
#define CAMERA_LEAST 2    /* that tell */
#define WAY_SIGMA_PX 0.1  /* of spots that touch, beyond their own */
#define SPREAD_LEAST 0.45 /* of what was expected: one marker alone, seen obliquely, has less */
#define SPREAD_MOST 2.5   /* ... more is not as expected */
#define SPREAD_SHARE 0.5  /* of the median, or their way: a camera with less sees one of them */
#define NEW_SHARE 0.9     /* ... of their way, of a camera that did not see both before */
#define ALONE_SHARE 0.3   /* ... and with less than this it is surely one of them */
#define VAGUE_SHARE 0.5   /* of the line: a spot that may be either one or both */

static bool are_in_sight(const struct matcher *m, uint32_t c, const int16_t seed[2])
{
	return m->cameras[c].view && m->in_sight[c][seed[0]] && m->in_sight[c][seed[1]];
}

/* The camera's spots nearest to where the two are expected, within so much of the line. */
static void find_nearest(const struct matcher *m, uint32_t c, const int16_t seed[2],
			 double reach_px, int blob[2])
{
	for (int i = 0; i < 2; i++)
		blob[i] = sight_index_nearest(&m->cameras[c], m->seen[c][seed[i]].pixel, reach_px);
}

/* Their one spot, if the camera has no better one for either. */
static int blob_of_both(const struct matcher *m, uint32_t c, const int16_t seed[2], double line_px)
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
	if (blob == BLOB_NONE)
		return BLOB_NONE;
	return camera->blobs[blob].flags & BLOB_EDGE ? BLOB_NONE : blob;
}

/* False when the camera does not have both in one spot. */
static bool find_spot(const struct matcher *m, uint32_t c, const struct label_state *labels,
		      const struct pressed *pressed, struct pressed_spot *out)
{
	const int16_t *seed = pressed->seed;

	if (!are_in_sight(m, c, seed))
		return false;
	for (int k = 0; k < 2; k++)
		out->line[k] = project_slope(&m->seen[c][seed[0]], k, pressed->apart_m);
	double x = out->line[0], y = out->line[1], line2_px2 = x * x + y * y;
	out->line_px = sqrt(line2_px2);
	out->blob = blob_of_both(m, c, seed, out->line_px);
	if (out->blob == BLOB_NONE)
		return false;
	const float *shape_px2 = m->cameras[c].blobs[out->blob].shape_px2;
	out->share_known = merged_share(labels, m, c, seed, &out->share);
	double light = out->share * (1 - out->share);
	out->longer_px2[0] = merged_excess_px2(shape_px2[0] - shape_px2[2]) / light;
	out->longer_px2[1] = merged_excess_px2(2 * shape_px2[1]) / light;
	out->ratio = ((x * x - y * y) * out->longer_px2[0] + 2 * x * y * out->longer_px2[1]) /
		     (line2_px2 * line2_px2);
	return shape_px2[0] > 0;
}

/* The camera has a spot for each, and so tells the way from one to the other. They touch: where
 * they do not, a camera that has but one spot sees one of them alone. */
static void find_way(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		     struct pressed_spots *out)
{
	double line_px = hypot(project_slope(&m->seen[c][pressed->seed[0]], 0, pressed->apart_m),
			       project_slope(&m->seen[c][pressed->seed[0]], 1, pressed->apart_m));
	int blob[2];

	find_nearest(m, c, pressed->seed, OFF_SHARE * line_px, blob);
	if (blob[0] == BLOB_NONE || blob[1] == BLOB_NONE || blob[0] == blob[1])
		return;
	const struct blob *one = &m->cameras[c].blobs[blob[0]],
			  *other = &m->cameras[c].blobs[blob[1]];
	if (!(one->flags & other->flags & BLOB_MERGED))
		return;
	out->apart_mask |= 1u << c;
	out->apart_px[c][0] = other->x_px - one->x_px;
	out->apart_px[c][1] = other->y_px - one->y_px;
	out->apart_sigma_px[c] =
		hypot(match_sigma_px(m, c, one), match_sigma_px(m, c, other)) + WAY_SIGMA_PX;
}

static void find_spots(const struct matcher *m, const struct label_state *labels,
		       const struct pressed *pressed, struct pressed_spots *spots)
{
	spots->count = 0;
	for (uint32_t c = 0; c < m->camera_count; c++) {
		if (!find_spot(m, c, labels, pressed, &spots->spot[spots->count]) ||
		    spots->spot[spots->count].line_px < LINE_MIN_PX)
			continue;
		spots->camera[spots->count++] = c;
	}
}

/* A single camera that has them in one spot tells too little: others must have a spot for each. */
static bool ask_others(const struct matcher *m, const struct label_state *labels,
		       struct vec3 expected_m, struct pressed *pressed, struct pressed_spots *spots)
{
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (are_in_sight(m, c, pressed->seed))
			find_way(m, c, pressed, spots);
	spots->count = 0;
	if (__builtin_popcount(spots->apart_mask) < CAMERA_LEAST ||
	    !pressed_fit(m, spots, expected_m, pressed))
		return false;
	find_spots(m, labels, pressed, spots);
	return spots->count > 0;
}

static double median_ratio(const struct pressed_spots *spots)
{
	double ratios[CAMERA_MAX];

	for (int i = 0; i < spots->count; i++)
		ratios[i] = spots->spot[i].ratio;
	return pressed_median(ratios, spots->count);
}

/* Cameras whose spot is one of the two alone. */
static void drop_single(struct pressed_spots *spots, double least_ratio)
{
	int kept = 0;

	for (int i = 0; i < spots->count; i++)
		if (spots->spot[i].ratio > least_ratio) {
			spots->camera[kept] = spots->camera[i];
			spots->spot[kept++] = spots->spot[i];
		}
	spots->count = kept;
}

/* How far apart the two are; false when no spot is both, or it is one alone. */
static bool find_apart(const struct matcher *m, const struct label_state *labels,
		       struct pressed *pressed)
{
	struct pressed_spots spots = {.count = 0};
	struct vec3 expected_m = pressed->apart_m;

	find_spots(m, labels, pressed, &spots);
	if (spots.count == 0 ||
	    (spots.count < CAMERA_LEAST && !ask_others(m, labels, expected_m, pressed, &spots)))
		return false;
	double ratio = median_ratio(&spots);
	bool as_expected = ratio > SPREAD_LEAST && ratio < SPREAD_MOST;

	if (as_expected)
		drop_single(&spots, SPREAD_SHARE * ratio);
	return pressed_fit(m, &spots, expected_m, pressed) &&
	       (as_expected || pressed_are_plainly_two(m, &spots, expected_m, pressed));
}

int pressed_find(const struct matcher *m, const struct label_state *labels, struct pressed *out)
{
	int count = 0;

	for (int i = 0; i < m->seed_count && count < PRESSED_MAX; i++) {
		int label = m->seeds[i].label;
		int below = label == LABEL_NONE ? LABEL_NONE : labels[label].below;
		int other = below == LABEL_NONE ? -1 : m->seed_of_label[below];

		if (other < 0 || !labels[label].confirmed || !labels[below].confirmed)
			continue;
		struct vec3 apart_m = vec3_sub(m->seed_stage_m[other], m->seed_stage_m[i]);
		out[count] = (struct pressed){{(int16_t)i, (int16_t)other}, apart_m};
		count += vec3_norm(apart_m) < NEAR_M && find_apart(m, labels, &out[count]);
	}
	return count;
}

/* When the two last had their names. */
static bool saw_both(const struct label_state *labels, uint32_t c, const int16_t label[2])
{
	return labels[label[0]].camera_mask & labels[label[1]].camera_mask & 1u << c;
}

enum merge pressed_part(const struct matcher *m, uint32_t c, const struct label_state *labels,
			const struct pressed *pressed, int *blob, struct parting *out)
{
	struct pressed_spot spot;

	if (!find_spot(m, c, labels, pressed, &spot))
		return MERGE_NONE;
	*blob = spot.blob;
	out->sigma_px = VAGUE_SHARE * spot.line_px;
	for (int i = 0; i < 2; i++)
		out->label[i] = m->seeds[pressed->seed[i]].label;
	bool knew_both = saw_both(labels, c, out->label);

	if (!knew_both && spot.ratio < ALONE_SHARE)
		return MERGE_NONE;
	if (spot.ratio < (knew_both ? SPREAD_SHARE : NEW_SHARE) || spot.line_px < LINE_MIN_PX)
		return MERGE_VAGUE;
	double along[2] = {spot.line[0] / spot.line_px, spot.line[1] / spot.line_px};
	merged_place(&m->cameras[c].blobs[spot.blob], along, spot.line_px, spot.share, out);
	out->sigma_px = merged_sigma_px(spot.share_known);
	return MERGE_PARTED;
}
