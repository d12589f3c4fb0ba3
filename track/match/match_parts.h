/*
 * Between the files of matching: how blobs are chosen around a place, and what becomes of them.
 */
#pragma once

#include <stdbool.h>

#include "track/match/match.h"

#define CANDIDATE_MAX (POINT_MAX * 4)
#define SLOPES_REACH_M 3e-3 /* so far a projection is carried on by its slopes: 0.01 px at most */

/* One blob per camera that may show one point (BLOB_NONE where there is none), and where
 * triangulation starts. */
struct choice {
	struct vec3 guess_stage_m;
	int count;
	int16_t blob[CAMERA_MAX];
	int seed;               /* whose projections are those of the guess; -1: not made */
	uint32_t outvoted_mask; /* cameras whose sight of it was not used in the last shot */
};

/* Solves with the chosen blobs. False when they give no point. */
bool point_from_choice(const struct matcher *matcher, const struct choice *choice,
		       struct point *out);

/* Whether enough views agree well enough. */
bool point_confirmed(const struct matcher *matcher, const struct point *point, int least_views);

/* Whether it is neither too near nor too far for the cameras of the mask. */
bool point_in_range(const struct matcher *matcher, struct vec3 p, uint32_t camera_mask);

void add_candidate(struct matcher *matcher, const struct point *point);

/* The best candidates take their blobs first; those of the rest are solved again without them. */
void claim_candidates(struct matcher *matcher);

/* The point is one of the shot's, its blobs are taken. */
void claim(struct matcher *matcher, const struct point *point);

/* Where camera c sees p, which is near the seed that was projected as `index`; -1: near none. */
bool project_near(const struct matcher *matcher, uint32_t c, struct vec3 p, int index,
		  double pixel[2]);

enum merge {
	MERGE_NONE,
	MERGE_PARTED,
	MERGE_VAGUE, /* it is somewhere between the two */
};

/* A spot that is two markers. */
struct parting {
	int16_t label[2];
	double cost_px2;
	double part_px[2][2];
	double sigma_px;
	enum half kind;
};

/* Longer than a marker seen obliquely. */
bool merged_is_long(const struct blob *blob);

/* The second one's share of the light, from when either was alone; false when that is not known. */
bool merged_share(const struct tracker_state *state, const struct matcher *matcher, uint32_t c,
		  const int16_t seed[2], double *share);

/* Share times the rest times the square of how far the two are apart, of a spot whose spread along
 * their line is larger by so much than across. */
double merged_excess_px2(double longer_px2);

/* The parts of a spot whose markers are so far apart along a direction. */
void merged_place(const struct blob *blob, const double along[2], double apart_px, double share,
		  struct parting *out);

/* How far a spot is drawn from the middle of its two towards the second one, and which share that
 * one then has. */
double merged_drawn_px(double share, double apart_px);
double merged_share_drawn(double drawn_px, double apart_px);

double merged_sigma_px(bool share_known);

/* Not so a half of a parted spot that is another label's. */
bool match_may_show(const struct matcher *matcher, uint32_t camera, int blob, int label);

#define PRESSED_MAX 64

/* Lips or lids that meet: two labels' seeds, the upper's first, and the way from it to the other.
 */
struct pressed {
	int16_t seed[2];
	struct vec3 apart_m;      /* as far as it is known */
	struct vec3 expected_m;   /* ... and was expected */
	double share[CAMERA_MAX]; /* the lower's share of their one spot's light; 0: not known */
};

/* Finds those that are one spot in some cameras; returns how many, up to PRESSED_MAX. */
int pressed_find(const struct matcher *matcher, const struct tracker_state *state,
		 struct pressed *out);

/* What the camera sees of the two: their spot with its parts, or with how vague it is. */
enum merge pressed_part(const struct matcher *matcher, uint32_t c,
			const struct tracker_state *state, const struct pressed *pressed, int *blob,
			struct parting *out);
