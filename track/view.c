/*
 * Rays and projections of a calibrated camera by table; view_build.c fills the tables.
 */
#include "track/view.h"

#include <stddef.h>

#include "track/view_parts.h"

void view_expect_ray(const struct view *view, const double pixel[2])
{
	lens_grid_expect(&view->pixel_to_plane, pixel[0], pixel[1]);
}

struct vec3 view_ray(const struct view *view, const double pixel[2])
{
	double u[2];

	lens_grid_at(&view->pixel_to_plane, pixel[0], pixel[1], u, NULL);

	double m = (u[0] * u[0] + u[1] * u[1]) / 4.0;
	struct vec3 v = {u[0] / (1 + m), u[1] / (1 + m), (1 - m) / (1 + m)};
	const double(*r)[3] = view->rt_cam_stage.r; /* transposed: camera to stage */

	return (struct vec3){r[0][0] * v.x + r[1][0] * v.y + r[2][0] * v.z,
			     r[0][1] * v.x + r[1][1] * v.y + r[2][1] * v.z,
			     r[0][2] * v.x + r[1][2] * v.y + r[2][2] * v.z};
}

bool view_project(const struct view *view, struct vec3 p_stage_m, double pixel[2],
		  double dq_dp[2][3])
{
	struct passage p = passage_enter(&view->rt_cam_stage, p_stage_m);
	double q[2], dq_du[2][2];

	if (!passage_is_seen(&p))
		return false;
	lens_grid_at(&view->plane_to_pixel, p.x * p.a, p.y * p.a, q, dq_dp ? dq_du : NULL);
	if (!view_shows(view, q))
		return false;
	pixel[0] = q[0];
	pixel[1] = q[1];
	if (dq_dp)
		for (int k = 0; k < 2; k++)
			passage_slopes(&p, dq_du[k], view->rt_cam_stage.r, dq_dp[k]);
	return true;
}

void view_turn(const struct view *view, struct vec3 p_stage_m, const double slopes[3],
	       double turn[3])
{
	struct vec3 d = vec3_sub(p_stage_m, view->centre_stage_m);

	turn[0] = slopes[1] * d.z - slopes[2] * d.y;
	turn[1] = slopes[2] * d.x - slopes[0] * d.z;
	turn[2] = slopes[0] * d.y - slopes[1] * d.x;
}
