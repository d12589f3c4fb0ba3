/*
 * Each camera for itself: its focal length, and where the board was in each view.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "base/sort.h"
#include "calib/board/homography.h"
#include "calib/board/plane_pose.h"
#include "calib/solve/seed_parts.h"

#define RMS_PART_MAX 0.03 /* of the width: more than any lens bends a board */

/* Into work->px. */
static void centre_view(struct seed_work *work, uint32_t view)
{
	const struct observations *o = work->observations;
	const struct observed_camera *camera = &o->cameras[o->views[view].camera];

	for (uint32_t i = 0; i < o->corner_count; i++) {
		work->px[i][0] = observations_px(o, view)[i][0] - (camera->width_px - 1) / 2.0;
		work->px[i][1] = observations_px(o, view)[i][1] - (camera->height_px - 1) / 2.0;
	}
}

static int fit_focal(struct seed_work *work, uint32_t camera, double *focal_px, double *aspect)
{
	const struct observations *o = work->observations;
	double half_width_px = o->cameras[camera].width_px / 2.0;
	struct focal_sums sums = {0};
	double h[9];

	for (uint32_t v = 0; v < o->view_count; v++) {
		if (o->views[v].camera != camera || !work->good[v])
			continue;
		centre_view(work, v);
		if (homography_fit(h, work->board_m, work->px, o->corner_count))
			work->good[v] = false;
		else
			focal_add(&sums, h, half_width_px);
	}
	*aspect = focal_aspect(&sums);
	if (!focal_from_sums(&sums, half_width_px, focal_px))
		return 0;
	diag_add(work->diag,
		 "camera %s: its views do not tell the focal length; tilt the board by 20 to 40 "
		 "degrees, to all sides, and check the numbers of squares",
		 o->cameras[camera].name);
	return -EINVAL;
}

static void fit_view(struct seed_work *work, uint32_t view, double focal_px)
{
	const struct observations *o = work->observations;
	double rms_px;

	centre_view(work, view);
	work->good[view] = !plane_pose_fit(&work->rt_cam_board[view], &rms_px, work->board_m,
					   work->px, o->corner_count, focal_px) &&
			   rms_px < RMS_PART_MAX * o->cameras[o->views[view].camera].width_px;
}

int seed_fit_views(struct seed_work *work, double *focal_px, double *board_aspect)
{
	const struct observations *o = work->observations;
	double aspects[CAMERA_MAX];
	int err = 0;

	for (uint32_t c = 0; c < o->camera_count; c++)
		if (fit_focal(work, c, &focal_px[c], &aspects[c]))
			err = -EINVAL;
	for (uint32_t v = 0; !err && v < o->view_count; v++)
		if (work->good[v])
			fit_view(work, v, focal_px[o->views[v].camera]);
	sort_doubles(aspects, o->camera_count);
	*board_aspect = aspects[o->camera_count / 2];
	return err;
}
