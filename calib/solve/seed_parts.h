/*
 * What the files of the seed share. Nobody else includes this.
 */
#pragma once

#include "calib/solve/seed.h"

#define NO_VIEW UINT32_MAX

struct seed_work {
	const struct observations *observations;
	struct diag *diag;
	uint32_t pose_count;
	uint32_t *view_of;           /* owned; view of nth pose and camera, or NO_VIEW */
	struct pose *rt_cam_board;   /* owned; per view */
	bool *good;                  /* owned; per view */
	double (*board_m)[2];        /* owned; corners on the plane */
	double (*px)[2];             /* owned; one view's pixels from the image's middle */
	struct vec3 board_ends_m[4]; /* four outer corners */
};

static inline uint32_t seed_view(const struct seed_work *work, uint32_t nth, uint32_t camera)
{
	uint32_t view = work->view_of[nth * work->observations->camera_count + camera];

	return view != NO_VIEW && work->good[view] ? view : NO_VIEW;
}

/* seed_check.c: too few views, duplicate cameras. Returns 0 or -EINVAL. */
int seed_check_views(const struct seed_work *work);
int seed_check_duplicates(const struct seed_work *work);

/* seed_views.c: focal lengths, then every view's pose. Returns 0 or -EINVAL. */
int seed_fit_views(struct seed_work *work, double *focal_px, double *board_aspect);

/* seed_graph.c: places all cameras in coordinates of camera 0. Returns 0 or -EINVAL. */
int seed_place_cameras(const struct seed_work *work, struct pose *rt_cam_ref);
