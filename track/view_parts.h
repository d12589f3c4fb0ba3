/*
 * The steps of a projection: for one point at a time and for many side by side.
 */
#pragma once

#include <stdbool.h>

#include "track/view.h"

/* A point on its way through the projection, camera coordinates. */
struct passage {
	double x, y, z, norm;
	double s; /* z + norm */
	double a; /* 2 / s */
};

static inline struct passage passage_enter(const struct pose *rt_cam_stage, struct vec3 p_stage_m)
{
	struct vec3 p = pose_apply(rt_cam_stage, p_stage_m);
	double norm = vec3_norm(p), s = p.z + norm;

	return (struct passage){p.x, p.y, p.z, norm, s, 2 / s};
}

/* Not straight behind, not at the centre, and a number. */
static inline bool passage_is_seen(const struct passage *p)
{
	return p->s > 1e-6 * p->norm;
}

/* False for NaN, which is what the table holds where the camera does not look. */
static inline bool view_shows(const struct view *view, const double pixel[2])
{
	double margin = view_margin_px(view);

	return (pixel[0] >= -margin) & (pixel[0] <= view->width_px - 1 + margin) &
	       (pixel[1] >= -margin) & (pixel[1] <= view->height_px - 1 + margin);
}

/* d q / d p of one coordinate of the pixel, by way of u = 2 (x, y) / s. */
static inline void passage_slopes(const struct passage *p, const double dq_du[2],
				  const double r[3][3], double dq_dp[3])
{
	double along = p->a / (p->s * p->norm) * (dq_du[0] * p->x + dq_du[1] * p->y);
	/* by the point in camera coordinates */
	double cx = dq_du[0] * p->a - along * p->x;
	double cy = dq_du[1] * p->a - along * p->y;
	double cz = -along * p->s;

	for (int j = 0; j < 3; j++)
		dq_dp[j] = cx * r[0][j] + cy * r[1][j] + cz * r[2][j];
}
