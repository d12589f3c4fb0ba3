/*
 * Blobs into 3D points, over all cameras at once and without names: first around predicted places
 * (seeds), then what is left by epipolar lines over camera pairs, confirmed by a third view.
 * Every blob belongs to at most one point. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/match/triangulate.h"
#include "track/observe.h"
#include "track/tracker.h"
#include "track/tracker_state.h"

#define POINT_MAX 1024
#define BLOB_NONE (-1)

struct point {
	struct fix fix;           /* its used_mask counts cameras, not sightings */
	uint32_t claimed_mask;    /* cameras whose blob is taken by this point, used or not */
	int16_t blob[CAMERA_MAX]; /* valid where claimed_mask says so */
	int16_t label;            /* LABEL_NONE until named */
	uint32_t outvoted_mask;   /* of the seed that it was found by, else 0 */
	bool is_pressed; /* two cameras': both have a plain half of lips or lids that meet */
};

#define SEED_MAX (LABEL_MAX + LOOSE_MAX)

/* Where a point is expected, and how far from there it may be. */
struct seed {
	struct vec3 p_stage_m;
	double radius_m;
	int16_t label;          /* whose place it is, or LABEL_NONE */
	uint32_t outvoted_mask; /* cameras whose sight of it was not used in the last shot */
};

#define SIGHT_STRIP_COUNT 256 /* of an image, across x */

#define SIGHT_SIDE 6 /* blobs looked at together; behind the last is room for as many */

/* One camera's blobs of the shot, indexed by place. */
struct sight_index {
	const struct view *view; /* NULL: the camera is missing or takes no part */
	const struct blob *blobs;
	int blob_count;
	double pixels_per_radian; /* at the middle of the image */
	double strips_per_px;
	uint16_t strip_from[SIGHT_STRIP_COUNT + 1]; /* into those placed strip by strip: */
	float placed_x_px[BLOB_MAX + SIGHT_SIDE], placed_y_px[BLOB_MAX + SIGHT_SIDE];
	int16_t placed[BLOB_MAX];
	int16_t owner[BLOB_MAX]; /* point that claimed the blob, or -1 */

	/* the blobs that the seeds left over, and their rays */
	int free_count;
	int16_t free[BLOB_MAX];
	float ray_x[BLOB_MAX], ray_y[BLOB_MAX], ray_z[BLOB_MAX];
};

/* What says that a parted spot is two markers. */
enum half {
	HALF_LONG,   /* it is long where two are expected */
	HALF_LIKELY, /* all cameras together, of lips or lids that meet */
	HALF_PLAIN,  /* they, and the spot by itself */
};

struct matcher {
	const struct tracker_settings *settings;
	double view_variance_px2;               /* added to every blob's own */
	double camera_variance_px2[CAMERA_MAX]; /* the same, by camera: all of it */
	uint32_t camera_count;
	struct sight_index cameras[CAMERA_MAX];
	/* of cameras with merged spots: their blobs, which one is the other half of each, or none,
	 * and whose half it is */
	struct blob parted[CAMERA_MAX][BLOB_MAX];
	int16_t other_half[CAMERA_MAX][BLOB_MAX], part_label[CAMERA_MAX][BLOB_MAX];
	uint8_t half_kind[CAMERA_MAX][BLOB_MAX]; /* enum half, of those that are halves */
	uint32_t point_count;
	struct point points[POINT_MAX];
	uint32_t candidate_count;
	struct point candidates[POINT_MAX * 4];
	uint16_t candidate_order[POINT_MAX * 4];

	/* the seeds of the shot: what the cameras would see of them, and the blobs there */
	int seed_count;
	struct seed seeds[SEED_MAX];
	struct vec3 seed_stage_m[SEED_MAX];
	bool seed_alone[SEED_MAX];        /* no camera has a second blob that could be meant */
	int16_t seed_of_label[LABEL_MAX]; /* or -1 */
	bool in_sight[CAMERA_MAX][SEED_MAX];
	struct projection seen[CAMERA_MAX][SEED_MAX];
	int16_t seed_blob[CAMERA_MAX][SEED_MAX];
};

void match_begin(struct matcher *matcher, const struct tracker_rig *rig,
		 const struct view_excess *excess, const struct shot *shot);

/* One standard deviation of a blob as a sight of its point. */
double match_sigma_px(const struct matcher *matcher, uint32_t camera, const struct blob *blob);

/* Projects the seeds, of which only SEED_MAX are used; needs no blobs. */
void match_prepare(struct matcher *matcher, const struct tracker_rig *rig, const struct seed *seeds,
		   int count);

/* Parts the spots that are two of the prepared seeds' markers, as their looks tell. */
void match_part_merged(struct matcher *matcher, const struct tracker_state *state);

/* Remembers how bright and how wide the named markers are in each camera that sees them alone, and
 * which ones see them at all. */
void match_learn_looks(const struct matcher *matcher, struct tracker_state *state);

/* Whether the blob is half of a parted spot, and of which two labels, the lower one first; NULL
 * where that does not matter. */
bool match_is_half(const struct matcher *matcher, uint32_t camera, int blob, int16_t pair[2]);

/* Whether all views of the point are plain halves of lips or lids that meet. */
bool match_is_pressed(const struct matcher *matcher, const struct point *point);

/* How many of the point's views show it surely: not so a half of a long spot whose other half is
 * nobody's, for then it may have been one marker's. Of halves alone those count that are of the
 * same two markers, and others take away; of up to three of lips or lids that meet two must be
 * plain, else only those count. When all points are found. */
int match_sure_views(const struct matcher *matcher, const struct point *point);

/* The point that at least three cameras confirm near one of the seeds; claims nothing. */
bool match_try_seed(struct matcher *matcher, int index, struct point *out);

/* Adds the points that at least three cameras confirm near a prepared seed. */
void match_seeds(struct matcher *matcher);

/* Adds the points that at least three cameras confirm among the blobs still free. */
void match_leftovers(struct matcher *matcher);

/* Looks for a point near the seed that only two cameras see, and adds it. Ambiguity is refused.
 * Returns its index, or -1. */
int match_two_cameras(struct matcher *matcher, const struct seed *seed);

/* The label across, of a pressed point. */
int match_across(const struct matcher *matcher, const struct point *point);

/* Of a pressed point of two cameras, adds that of the spots' other halves, if both are the same
 * label's and free. Returns its index, or -1. */
int match_other_halves(struct matcher *matcher, int point);

/* The last point was not what it was looked for: its blobs are free again. */
void match_give_back(struct matcher *matcher);
