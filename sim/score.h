/*
 * How well the tracker did against the truth of a scene. Truth meets tracker only here.
 * docs/tracking-figures.md says what each count means, and why.
 */
#pragma once

#include <stdint.h>

#include "sim/world/scene.h"
#include "track/observe.h"

#define SCORE_NEAR_M 0.003 /* a marker further than this from its true place is wrong */
#define SCORE_SURE 0.99
#define SCORE_BINS 4 /* measured by 2, 3, 4 and by 5 or more cameras */

/* Right names only: a wrong one says nothing about covariances. */
struct score_bin {
	uint64_t count;
	uint64_t inside; /* the 95 % ellipsoid about it holds the truth */
	double nees;     /* sum; three degrees of freedom each */
	double error2_m2;
};

struct score {
	uint64_t shots;
	uint64_t seen3;    /* true markers that three or more of the shot's cameras see */
	uint64_t right;    /* of those, named right */
	uint64_t unnamed;  /* of those, without a name or missing */
	uint64_t wrong;    /* measured under a name whose true marker is not there; of those: */
	uint64_t swapped;  /* another marker is there */
	uint64_t ghosts;   /* a bright spot of a tooth or an eye is there */
	uint64_t unseen;   /* measured, it says, and fewer than two cameras see its true marker */
	uint64_t measured; /* named, measured, three or more views */
	uint64_t stray;    /* points without a name that are no true marker */
	uint64_t two_right, two_wrong;
	uint64_t sure, sure_wrong; /* names with a confidence of SCORE_SURE or more */
	double error2_m2;          /* sum over right ones of three or more views */
	double nees;               /* sum over right ones of three or more views */
	struct score_bin bins[SCORE_BINS];
	struct score_bin predicted; /* filled in, of markers that are worn */
	double head_error2_m2;      /* of a point on the face of the first actor */
	uint64_t heads;
	int64_t first_named_shot; /* first shot with nine in ten named right; -1 = none yet */
	int64_t first_wrong_shot; /* number of the first shot with one; -1 = none */
};

/* An error in units of its covariance: e' C^-1 e. */
double score_nees(struct vec3 e, const double cov_m2[6]);

void score_init(struct score *score);
void score_shot(struct score *score, const struct sim_truth *truth, const struct marker_set *set);

enum score_verdict {
	SCORE_RIGHT,
	SCORE_OFF,     /* too far from its true place, and nothing else is there */
	SCORE_SWAPPED, /* another marker is there */
	SCORE_GHOST,
};

/* Of a label that the set says was measured. */
enum score_verdict score_judge(const struct sim_truth *truth, uint32_t label,
			       const struct marker *marker);
