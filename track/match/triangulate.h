/*
 * A point from its views: weighted Gauss-Newton on the reprojection error over all views,
 * covariance out (Hartley and Sturm 1997; Hartley and Zisserman, Multiple View Geometry, ch. 12).
 * Where the views disagree, every reading of which ones are bad has its say (view_doubt.c). Pure
 * and real-time safe.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/observe.h"
#include "track/view.h"

/* One camera's sight of the point. */
struct sighting {
	const struct view *view;
	double pixel[2];
	double sigma_px;
	uint16_t flags;    /* of the blob, enum blob_flag: how likely it is bad */
	bool was_outvoted; /* in the last shot: what was wrong then may be still */
	/* of the guess that triangulate() is given, borrowed; NULL: it is made there */
	const struct projection *at_guess;
};

struct fix {
	struct vec3 p_stage_m;
	double cov_m2[6];    /* xx xy xz yy yz zz */
	double residual_px;  /* rms distance in the image over the views used */
	double chi2_per_dof; /* of the views used; about 1 when the sigmas are true */
	uint32_t used_mask;  /* bit i: sightings[i] is good, more likely than not */
	int used_count;
};

/* One standard deviation per axis, averaged over the axes. */
static inline double fix_noise_m(const struct fix *fix)
{
	return sqrt((fix->cov_m2[0] + fix->cov_m2[3] + fix->cov_m2[5]) / 3);
}

/* 2 to CAMERA_MAX sightings; starts from the guess, or from the rays where that is NULL. A view is
 * not used when it is more likely bad than good. Returns 0, or -EDOM when the point is out
 * of a camera's sight or cannot be fixed. */
int triangulate(const struct sighting *sightings, int count, const struct vec3 *guess_stage_m,
		struct fix *out);
