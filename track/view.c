/*
 * Rays and projections of a calibrated camera by table; view_build.c fills the tables.
 */
#include "track/view.h"

#include <stddef.h>

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

/* False for NaN, which is what the table holds where the camera does not look. */
static bool near_image(const struct view *view, const double pixel[2])
{
	double margin = view_margin_px(view);

	return pixel[0] >= -margin && pixel[0] <= view->width_px - 1 + margin &&
	       pixel[1] >= -margin && pixel[1] <= view->height_px - 1 + margin;
}

/* d u / d p of u = 2 (x, y) / (z + |p|), with s = z + |p|. */
static void plane_gradient(struct vec3 p, double norm, double s, double du_dp[2][3])
{
	double a = 2.0 / s, b = a / (s * norm);

	du_dp[0][0] = a - b * p.x * p.x;
	du_dp[0][1] = -b * p.x * p.y;
	du_dp[0][2] = -b * p.x * s;
	du_dp[1][0] = -b * p.x * p.y;
	du_dp[1][1] = a - b * p.y * p.y;
	du_dp[1][2] = -b * p.y * s;
}

static void chain_gradients(const double dq_du[2][2], const double du_dp[2][3],
			    const double r[3][3], double dq_dp[2][3])
{
	for (int i = 0; i < 2; i++) {
		double c[3]; /* by the point in camera coordinates */

		for (int j = 0; j < 3; j++)
			c[j] = dq_du[i][0] * du_dp[0][j] + dq_du[i][1] * du_dp[1][j];
		for (int j = 0; j < 3; j++)
			dq_dp[i][j] = c[0] * r[0][j] + c[1] * r[1][j] + c[2] * r[2][j];
	}
}

bool view_project(const struct view *view, struct vec3 p_stage_m, double pixel[2],
		  double dq_dp[2][3])
{
	struct vec3 p = pose_apply(&view->rt_cam_stage, p_stage_m);
	double norm = vec3_norm(p), s = p.z + norm;
	double q[2], dq_du[2][2], du_dp[2][3];

	if (!(s > 1e-6 * norm)) /* straight behind, at the centre, or not a number */
		return false;
	lens_grid_at(&view->plane_to_pixel, 2 * p.x / s, 2 * p.y / s, q, dq_dp ? dq_du : NULL);
	if (!near_image(view, q))
		return false;
	pixel[0] = q[0];
	pixel[1] = q[1];
	if (dq_dp) {
		plane_gradient(p, norm, s, du_dp);
		chain_gradients(dq_du, du_dp, view->rt_cam_stage.r, dq_dp);
	}
	return true;
}
