/*
 * Lips and lids that meet: an upper marker and the one across below it, whose light runs into one
 * spot in most cameras. From one to the other it is as far for all of them, so that their spots
 * together tell it, where each one's is too short to be told from a disc seen obliquely.
 */
#include "track/match/match_parts.h"
#include "track/match/sight_index.h"
#include "track/match/triangulate_parts.h"

#define NEAR_M 0.006     /* so far apart at most are they expected */
#define LINE_MIN_PX 0.7  /* ... and at least, in a camera that may tell */
#define OFF_SHARE 0.4    /* of that: so far from the middle is their spot, and ... */
#define OFF_PX 0.8       /* ... so much more, as neither is expected exactly */
#define CAMERA_LEAST 2   /* that tell */
#define WAY_SIGMA_PX 0.1 /* of spots that touch, beyond their own */
#define SPREAD_SHARE 0.5 /* of what their way asks for: with less, one may be there alone */
#define SPREAD_SIGMA_PX2 0.2
#define LINE_SHARE 0.25         /* of the line's square: a spread tells it no better */
#define EXPECTED_SIGMA_M 0.0008 /* of the way from one to the other */
#define APART_OFF_M 0.0024      /* farther from there it is not these two's */
#define ROBUST_SIGMAS 2.0
#define LENIENCE 8.0 /* times as many in the first round, as the way may be far off yet */
#define ROUNDS 5
#define EVIDENCE_SIGMAS 3.0 /* what one spot tells at most */
#define EVIDENCE_LEAST 4
#define VAGUE_SHARE 0.5 /* of the line: a spot that may be either one or both */

/* One camera's spot of the two. */
struct pressed_spot {
	int blob;
	bool share_known;
	double share;
	double line[2], line_px; /* from the first to the second */
	double longer_px2[2];    /* xx - yy and 2 xy of what its spread says of the line */
	double ratio;            /* of that along the line, over what was expected */
};

static double project_slope(const struct projection *q, int axis, struct vec3 d)
{
	const double *slope = q->slopes[axis];

	return slope[0] * d.x + slope[1] * d.y + slope[2] * d.z;
}

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

static void add_equation(double normal[6], struct vec3 *right, double error, struct vec3 slope,
			 double weight)
{
	*right = vec3_add(*right, vec3_scale(slope, weight * error));
	sym3_add(normal,
		 (double[]){slope.x * slope.x, slope.x * slope.y, slope.x * slope.z,
			    slope.y * slope.y, slope.y * slope.z, slope.z * slope.z},
		 weight);
}

/* Of what a spot says of such a line. */
static double spread_sigma_px2(const struct pressed_spot *spot, const double line_px[2])
{
	return hypot(SPREAD_SIGMA_PX2 / (spot->share * (1 - spot->share)),
		     LINE_SHARE * (line_px[0] * line_px[0] + line_px[1] * line_px[1]));
}

/* The line that two so far apart have in the camera, and by how much its spot says otherwise: it
 * tells x^2 - y^2 and 2 x y, as its spread has no direction. */
static void compare(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		    const struct pressed_spot *spot, double line[2], double off[2])
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];

	for (int k = 0; k < 2; k++)
		line[k] = project_slope(q, k, pressed->apart_m);
	off[0] = spot->longer_px2[0] - (line[0] * line[0] - line[1] * line[1]);
	off[1] = spot->longer_px2[1] - 2 * line[0] * line[1];
}

/* A spot that says much else is another marker's too (Geman-McClure). The kernel narrows round by
 * round (graduated non-convexity; Yang et al. 2020): a way that is far off yet would else make
 * outliers of all who know better. */
static void add_spot(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		     const struct pressed_spot *spot, double lenience, double normal[6],
		     struct vec3 *right)
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];
	struct vec3 jx = {q->slopes[0][0], q->slopes[0][1], q->slopes[0][2]};
	struct vec3 jy = {q->slopes[1][0], q->slopes[1][1], q->slopes[1][2]};
	double line[2], off[2];

	compare(m, c, pressed, spot, line, off);
	double x = line[0], y = line[1], sigma_px2 = spread_sigma_px2(spot, line);
	double far = hypot(off[0], off[1]) / (lenience * ROBUST_SIGMAS * sigma_px2);
	double weight = 1 / (sigma_px2 * (1 + far * far));

	add_equation(normal, right, off[0], vec3_sub(vec3_scale(jx, 2 * x), vec3_scale(jy, 2 * y)),
		     weight * weight);
	add_equation(normal, right, off[1], vec3_add(vec3_scale(jx, 2 * y), vec3_scale(jy, 2 * x)),
		     weight * weight);
}

struct pressed_spots {
	int count;
	uint32_t camera[CAMERA_MAX];
	struct pressed_spot spot[CAMERA_MAX];
	uint32_t apart_mask; /* cameras that have a spot for each */
	double apart_px[CAMERA_MAX][2], apart_sigma_px[CAMERA_MAX];
};

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

static void add_way(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		    const struct pressed_spots *spots, double normal[6], struct vec3 *right)
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];
	double weight = 1 / (spots->apart_sigma_px[c] * spots->apart_sigma_px[c]);

	for (int k = 0; k < 2; k++) {
		struct vec3 slope = {q->slopes[k][0], q->slopes[k][1], q->slopes[k][2]};

		add_equation(normal, right,
			     spots->apart_px[c][k] - vec3_dot(slope, pressed->apart_m), slope,
			     weight);
	}
}

/* Gauss-Newton from what is known so far, and leaning on where they were expected. */
static bool solve_apart(const struct matcher *m, const struct pressed_spots *spots,
			struct vec3 expected_m, struct pressed *pressed)
{
	const double prior = 1 / (EXPECTED_SIGMA_M * EXPECTED_SIGMA_M);

	for (int round = 0; round < ROUNDS; round++) {
		double lenience = LENIENCE / (1 + round * (LENIENCE - 1) / (ROUNDS - 1));
		double normal[6] = {prior, 0, 0, prior, 0, prior}, inverse[6], determinant;
		struct vec3 right = vec3_scale(vec3_sub(expected_m, pressed->apart_m), prior);

		for (uint32_t left = spots->apart_mask; left; left &= left - 1)
			add_way(m, (uint32_t)__builtin_ctz(left), pressed, spots, normal, &right);
		for (int i = 0; i < spots->count; i++)
			add_spot(m, spots->camera[i], pressed, &spots->spot[i], lenience, normal,
				 &right);
		if (!sym3_invert(normal, inverse, &determinant))
			return false;
		pressed->apart_m = vec3_add(pressed->apart_m, sym3_apply(inverse, right));
	}
	return true;
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
	    !solve_apart(m, spots, expected_m, pressed))
		return false;
	find_spots(m, labels, pressed, spots);
	return spots->count > 0;
}

/* In squared sigmas, Geman-McClure. */
static double misfit(const double off[2], double sigma_px2)
{
	double z2 = (off[0] * off[0] + off[1] * off[1]) / (sigma_px2 * sigma_px2);

	return z2 / (1 + z2 / (EVIDENCE_SIGMAS * EVIDENCE_SIGMAS));
}

/* By how much two markers so far apart fit the spots better than one does. */
static double evidence_of_two(const struct matcher *m, const struct pressed_spots *spots,
			      const struct pressed *pressed)
{
	const double none_px[2] = {0, 0};
	double evidence = 0;

	for (int i = 0; i < spots->count; i++) {
		const struct pressed_spot *spot = &spots->spot[i];
		double line[2], off[2];

		compare(m, spots->camera[i], pressed, spot, line, off);
		evidence += misfit(spot->longer_px2, spread_sigma_px2(spot, none_px)) -
			    misfit(off, spread_sigma_px2(spot, line));
	}
	return evidence;
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
	return solve_apart(m, &spots, expected_m, pressed) &&
	       vec3_distance(pressed->apart_m, expected_m) < APART_OFF_M &&
	       evidence_of_two(m, &spots, pressed) > EVIDENCE_LEAST;
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
	if (spot.ratio < 0 && !saw_both(labels, c, out->label))
		return MERGE_NONE;
	if (spot.ratio < SPREAD_SHARE || spot.line_px < LINE_MIN_PX)
		return MERGE_VAGUE;
	double along[2] = {spot.line[0] / spot.line_px, spot.line[1] / spot.line_px};
	merged_place(&m->cameras[c].blobs[spot.blob], along, spot.line_px, spot.share, out);
	out->sigma_px = merged_sigma_px(spot.share_known);
	return MERGE_PARTED;
}
