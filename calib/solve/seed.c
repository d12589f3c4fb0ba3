/*
 * The steps of the seed, and the board poses in coordinates of the reference.
 */
#include "calib/solve/seed.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/solve/seed_parts.h"

#define RMS_PART_MAX 0.05 /* of the width: a view off by more contradicts the others */

static void work_finish(struct seed_work *work)
{
	free(work->view_of);
	free(work->rt_cam_board);
	free(work->good);
	free(work->board_m);
	free(work->px);
}

static void list_views(struct seed_work *work)
{
	const struct observations *o = work->observations;
	uint32_t nth = 0;

	for (size_t i = 0; i < (size_t)work->pose_count * o->camera_count; i++)
		work->view_of[i] = NO_VIEW;
	for (uint32_t v = 0; v < o->view_count; v++) {
		nth += v > 0 && o->views[v].pose != o->views[v - 1].pose;
		work->view_of[nth * o->camera_count + o->views[v].camera] = v;
		work->good[v] = o->views[v].seen_count >= SEED_CORNERS_MIN;
	}
}

static void list_corners(struct seed_work *work)
{
	const struct board *board = &work->observations->board;
	int last = board_corner_count(board) - 1, across = board_corners_x(board) - 1;
	const int ends[4] = {0, across, last - across, last};

	for (int i = 0; i <= last; i++) {
		struct vec3 corner = board_corner_m(board, i);

		work->board_m[i][0] = corner.x;
		work->board_m[i][1] = corner.y;
	}
	for (int e = 0; e < 4; e++)
		work->board_ends_m[e] =
			(struct vec3){work->board_m[ends[e]][0], work->board_m[ends[e]][1], 0};
}

static int work_init(struct seed_work *work, const struct observations *o, struct diag *diag)
{
	*work = (struct seed_work){.observations = o, .diag = diag};
	work->pose_count = observations_pose_count(o);
	work->view_of = calloc((size_t)work->pose_count * o->camera_count + 1, sizeof(uint32_t));
	work->rt_cam_board = calloc(o->view_count + 1, sizeof(*work->rt_cam_board));
	work->good = calloc(o->view_count + 1, sizeof(*work->good));
	work->board_m = calloc(o->corner_count, sizeof(*work->board_m));
	work->px = calloc(o->corner_count, sizeof(*work->px));
	if (!work->view_of || !work->rt_cam_board || !work->good || !work->board_m || !work->px) {
		work_finish(work);
		return -ENOMEM;
	}
	list_views(work);
	list_corners(work);
	return 0;
}

/* Sum of squared pixels between a view and the board placed at `rt_ref_board`; behind the camera
 * is infinitely far. */
static double view_error(const struct seed_work *work, const struct seed *seed, uint32_t view,
			 const struct pose *rt_ref_board)
{
	const struct observations *o = work->observations;
	uint32_t c = o->views[view].camera;
	struct pose rt_cam_board = pose_compose(&seed->rt_cam_ref[c], rt_ref_board);
	double x0 = (o->cameras[c].width_px - 1) / 2.0, y0 = (o->cameras[c].height_px - 1) / 2.0;
	double sum = 0;

	for (uint32_t i = 0; i < o->corner_count; i++) {
		const double *px = observations_px(o, view)[i];
		struct vec3 p = pose_apply(
			&rt_cam_board, (struct vec3){work->board_m[i][0], work->board_m[i][1], 0});
		if (isnan(px[0] + px[1]))
			continue;
		if (p.z <= 0)
			return INFINITY;
		double ex = px[0] - x0 - seed->focal_px[c] * p.x / p.z;
		double ey = px[1] - y0 - seed->focal_px[c] * p.y / p.z;
		sum += ex * ex + ey * ey;
	}
	return sum;
}

/* Of all cameras that saw the board in this pose, the one whose account suits all of them best. */
static void place_board(const struct seed_work *work, struct seed *seed, uint32_t nth)
{
	uint32_t count = work->observations->camera_count;
	double best = INFINITY;

	seed->rt_ref_board[nth] = (struct pose)POSE_IDENTITY;
	seed->rt_ref_board[nth].t.z = 1;
	for (uint32_t c = 0; c < count; c++) {
		uint32_t view = seed_view(work, nth, c);

		if (view == NO_VIEW)
			continue;
		struct pose rt_ref_cam = pose_inverse(&seed->rt_cam_ref[c]);
		struct pose candidate = pose_compose(&rt_ref_cam, &work->rt_cam_board[view]);
		double sum = 0;
		for (uint32_t other = 0; other < count; other++) {
			uint32_t at = seed_view(work, nth, other);

			if (at != NO_VIEW)
				sum += fmin(view_error(work, seed, at, &candidate), 1e9);
		}
		if (sum < best) {
			best = sum;
			seed->rt_ref_board[nth] = candidate;
		}
	}
}

/* Refuses views that contradict the others. */
static void judge_views(const struct seed_work *work, struct seed *seed)
{
	const struct observations *o = work->observations;
	double sum = 0, corners = 0;

	for (uint32_t n = 0; n < work->pose_count; n++)
		for (uint32_t c = 0; c < o->camera_count; c++) {
			uint32_t view = seed_view(work, n, c);

			if (view == NO_VIEW)
				continue;
			double error = view_error(work, seed, view, &seed->rt_ref_board[n]);
			double seen = o->views[view].seen_count;
			double limit_px = RMS_PART_MAX * o->cameras[c].width_px;
			if (error > seen * limit_px * limit_px) {
				work->good[view] = false;
				continue;
			}
			sum += error;
			corners += seen;
		}
	seed->rms_px = corners > 0 ? sqrt(sum / corners) : 0;
}

static int make(struct seed_work *work, struct seed *seed)
{
	int err = seed_check_views(work);

	if (!err)
		err = seed_check_duplicates(work);
	if (!err)
		err = seed_fit_views(work, seed->focal_px, &seed->board_aspect);
	if (!err)
		err = seed_check_views(work);
	if (!err)
		err = seed_place_cameras(work, seed->rt_cam_ref);
	if (err)
		return err;
	for (uint32_t n = 0; n < work->pose_count; n++)
		place_board(work, seed, n);
	judge_views(work, seed);
	return seed_check_views(work);
}

int seed_make(struct seed *seed, const struct observations *observations, struct diag *diag)
{
	struct seed made = {0};
	struct seed_work work;
	int err = work_init(&work, observations, diag);

	if (err)
		return err;
	made.pose_count = work.pose_count;
	made.rt_ref_board = calloc(work.pose_count + 1, sizeof(*made.rt_ref_board));
	err = made.rt_ref_board ? make(&work, &made) : -ENOMEM;
	if (err)
		goto fail;
	made.good_view = work.good;
	work.good = NULL;
	for (uint32_t v = 0; v < observations->view_count; v++)
		made.refused += !made.good_view[v];
	work_finish(&work);
	*seed = made;
	return 0;
fail:
	work_finish(&work);
	seed_finish(&made);
	return err;
}

void seed_finish(struct seed *seed)
{
	free(seed->rt_ref_board);
	free(seed->good_view);
	memset(seed, 0, sizeof(*seed));
}
