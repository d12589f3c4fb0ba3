/*
 * Projection through mrcal's lens models, and its inverse.
 */
#include "calib/board/sight.h"

#include <errno.h>
#include <mrcal/mrcal.h>
#include <string.h>

#include "calib/rt.h"
#include "calib/solve/small_solve.h"

#define ROUNDS 8
#define DONE_M 1e-9

struct vec3 solution_centre_m(const struct solution *solution, uint32_t camera)
{
	struct pose rt_cam_ref = pose_from_rt(solution->rt_cam_ref[camera]);

	return pose_inverse(&rt_cam_ref).t;
}

bool solution_project(const struct solution *solution, uint32_t camera, struct vec3 p_ref_m,
		      double px[2])
{
	struct sight sight;

	if (!solution_sight(solution, camera, p_ref_m, &sight, NULL))
		return false;
	memcpy(px, sight.px, sizeof(sight.px));
	return true;
}

bool solution_sight(const struct solution *solution, uint32_t camera, struct vec3 p_ref_m,
		    struct sight *sight, double *by_lens)
{
	const double *lens_numbers = solution->intrinsics + camera * solution->lens_count;
	double p_ref[3] = {p_ref_m.x, p_ref_m.y, p_ref_m.z};
	double by_pose[3][6], by_point[3][3];
	mrcal_lensmodel_t lens;
	mrcal_point3_t p, dq_dp[2];
	mrcal_point2_t q;

	if (!mrcal_lensmodel_from_name(&lens, solution->lens))
		return false;
	mrcal_transform_point_rt((double *)&p, (double *)by_pose, (double *)by_point,
				 solution->rt_cam_ref[camera], p_ref);
	/* one point at a time: with more, gradients stay unwritten */
	if (p.z <= 0 || !mrcal_project(&q, dq_dp, by_lens, &p, 1, &lens, lens_numbers))
		return false;
	sight->px[0] = q.x;
	sight->px[1] = q.y;
	for (int i = 0; i < 2; i++) {
		const double by_p[3] = {dq_dp[i].x, dq_dp[i].y, dq_dp[i].z};

		for (int k = 0; k < 3; k++)
			sight->by_point[i][k] = by_p[0] * by_point[0][k] +
						by_p[1] * by_point[1][k] + by_p[2] * by_point[2][k];
		for (int k = 0; k < 6; k++)
			sight->by_pose[i][k] = by_p[0] * by_pose[0][k] + by_p[1] * by_pose[1][k] +
					       by_p[2] * by_pose[2][k];
	}
	return true;
}

/* One Gauss-Newton step. */
static int step(const struct solution *solution, uint32_t camera_mask, const double (*px)[2],
		struct vec3 *p, double *moved_m)
{
	double a[9] = {0}, b[3] = {0};
	int count = 0;

	for (uint32_t c = 0; c < solution->camera_count; c++) {
		struct sight sight;

		if (!(camera_mask & 1U << c) || !solution_sight(solution, c, *p, &sight, NULL))
			continue;
		for (int i = 0; i < 2; i++)
			small_solve_add(3, a, b, sight.by_point[i], px[c][i] - sight.px[i], 1);
		count++;
	}
	if (count < 2 || small_solve(3, a, b))
		return -EDOM;
	struct vec3 move = {b[0], b[1], b[2]};
	*p = vec3_add(*p, move);
	*moved_m = vec3_norm(move);
	return 0;
}

int solution_triangulate(const struct solution *solution, uint32_t camera_mask,
			 const double (*px)[2], struct vec3 start_m, struct vec3 *p_ref_m)
{
	struct vec3 p = start_m;
	double moved_m = INFINITY;

	for (int round = 0; round < ROUNDS && moved_m > DONE_M; round++)
		if (step(solution, camera_mask, px, &p, &moved_m))
			return -EDOM;
	*p_ref_m = p;
	return 0;
}
