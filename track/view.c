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

/* A point on its way through the projection, camera coordinates. */
struct passage {
	double x, y, z, norm;
	double s; /* z + norm */
	double a; /* 2 / s */
};

static inline struct passage enter(const struct pose *rt_cam_stage, struct vec3 p_stage_m)
{
	struct vec3 p = pose_apply(rt_cam_stage, p_stage_m);
	double norm = vec3_norm(p), s = p.z + norm;

	return (struct passage){p.x, p.y, p.z, norm, s, 2 / s};
}

/* Not straight behind, not at the centre, and a number. */
static inline bool is_seen(const struct passage *p)
{
	return p->s > 1e-6 * p->norm;
}

/* d q / d p by way of u = 2 (x, y) / s. */
static inline void chain_slopes(const struct passage *p, const double dq_du[2][2],
				const double r[3][3], double dq_dp[2][3])
{
	double b = p->a / (p->s * p->norm);

	for (int i = 0; i < 2; i++) {
		double along = b * (dq_du[i][0] * p->x + dq_du[i][1] * p->y);
		/* by the point in camera coordinates */
		double cx = dq_du[i][0] * p->a - along * p->x;
		double cy = dq_du[i][1] * p->a - along * p->y;
		double cz = -along * p->s;

		for (int j = 0; j < 3; j++)
			dq_dp[i][j] = cx * r[0][j] + cy * r[1][j] + cz * r[2][j];
	}
}

bool view_project(const struct view *view, struct vec3 p_stage_m, double pixel[2],
		  double dq_dp[2][3])
{
	struct passage p = enter(&view->rt_cam_stage, p_stage_m);
	double q[2], dq_du[2][2];

	if (!is_seen(&p))
		return false;
	lens_grid_at(&view->plane_to_pixel, p.x * p.a, p.y * p.a, q, dq_dp ? dq_du : NULL);
	if (!near_image(view, q))
		return false;
	pixel[0] = q[0];
	pixel[1] = q[1];
	if (dq_dp)
		chain_slopes(&p, dq_du, view->rt_cam_stage.r, dq_dp);
	return true;
}

#define CHUNK 16

/* What waits for a square root or a quotient is done for many points in turn, so that none waits
 * for the other. */
static void project_chunk(const struct view *view, const struct vec3 *p_stage_m, int count,
			  struct projection *out, bool *in_sight)
{
	struct passage p[CHUNK];
	double dq_du[CHUNK][2][2];

	for (int i = 0; i < count; i++)
		p[i] = enter(&view->rt_cam_stage, p_stage_m[i]);
	for (int i = 0; i < count; i++) {
		in_sight[i] = is_seen(&p[i]);
		if (!in_sight[i])
			continue;
		lens_grid_at(&view->plane_to_pixel, p[i].x * p[i].a, p[i].y * p[i].a, out[i].pixel,
			     dq_du[i]);
		in_sight[i] = near_image(view, out[i].pixel);
	}
	for (int i = 0; i < count; i++)
		if (in_sight[i])
			chain_slopes(&p[i], dq_du[i], view->rt_cam_stage.r, out[i].slopes);
}

void view_project_many(const struct view *view, const struct vec3 *p_stage_m, int count,
		       struct projection *out, bool *in_sight)
{
	for (int i = 0; i < count; i += CHUNK)
		project_chunk(view, p_stage_m + i, count - i < CHUNK ? count - i : CHUNK, out + i,
			      in_sight + i);
}

void view_turn(const struct view *view, struct vec3 p_stage_m, const double slopes[3],
	       double turn[3])
{
	struct vec3 d = vec3_sub(p_stage_m, view->centre_stage_m);

	turn[0] = slopes[1] * d.z - slopes[2] * d.y;
	turn[1] = slopes[2] * d.x - slopes[0] * d.z;
	turn[2] = slopes[0] * d.y - slopes[1] * d.x;
}
