/*
 * A calibrated camera as tracking needs it: rays and projections by table, so that any mrcal lens
 * model costs the same few tens of nanoseconds and no iteration runs per frame.
 *
 * The tables lead between pixels and the stereographic plane u = 2 (x, y) / (z + |p|) of a
 * direction p in camera coordinates, which is smooth for every lens and field of view short of
 * straight behind (mrcal's LENSMODEL_STEREOGRAPHIC without its core).
 */
#pragma once

#include <stdbool.h>

#include "base/geometry.h"
#include "track/lens_grid.h"

/* Where a view sees a point of space, and the derivative of that, 1/m. */
struct projection {
	double pixel[2];
	double slopes[2][3];
};

/* Pixels along the image's axis per metre at the projected place. */
static inline struct vec3 slope_of(const struct projection *q, int axis)
{
	return (struct vec3){q->slopes[axis][0], q->slopes[axis][1], q->slopes[axis][2]};
}

/* Of a vector in space at the projected place: how far along the image's axis, in pixels. */
static inline double project_slope(const struct projection *q, int axis, struct vec3 d)
{
	return vec3_dot(slope_of(q, axis), d);
}

struct view {
	int width_px, height_px;
	struct pose rt_cam_stage;
	struct vec3 centre_stage_m;      /* of the camera, in stage coordinates */
	struct lens_grid pixel_to_plane; /* reaches VIEW_PAD steps beyond the image */
	struct lens_grid plane_to_pixel; /* NaN farther out than that */
};

#define VIEW_PAD 4

/* Projects lens-model coordinates; supplied by whoever knows the model. Both return false where
 * the model is not valid. `user` is passed through. */
struct lens_model {
	bool (*project)(const void *user, struct vec3 p_cam, double pixel[2]);
	bool (*unproject)(const void *user, const double pixel[2], struct vec3 *v_cam);
	const void *user;
};

/* Builds the tables. Returns 0, -EINVAL for an image smaller than VIEW_SIZE_MIN_PX, -ENOMEM, or
 * -EDOM when the model cannot be inverted over the whole image; then `bad_pixel` says where.
 * Allocates: control thread only. On failure nothing is held. */
int view_init(struct view *view, int width_px, int height_px, struct pose rt_cam_stage,
	      const struct lens_model *model, double bad_pixel[2]);
void view_finish(struct view *view); /* a zeroed view is fine */

#define VIEW_MARGIN_MAX_PX 8.0

/* A point this far outside the image is still projected: a step of the table, at most the above. */
static inline double view_margin_px(const struct view *view)
{
	double x_step = view->pixel_to_plane.x_step, y_step = view->pixel_to_plane.y_step;
	double step = x_step < y_step ? x_step : y_step;

	return step < VIEW_MARGIN_MAX_PX ? step : VIEW_MARGIN_MAX_PX;
}

#define VIEW_SIZE_MIN_PX 32

/* Real-time safe from here on. Returns false when the point is behind the camera or outside the
 * image by more than the margin. `dq_dp`, when not NULL, gets the derivative of the pixel
 * by the stage point, 1/m. */
bool view_project(const struct view *view, struct vec3 p_stage_m, double pixel[2],
		  double dq_dp[2][3]);

/* The same for many points at once, with slopes: in_sight[i] is what view_project() returns, out[i]
 * is valid where that is true. The same bits as one by one. */
void view_project_many(const struct view *view, const struct vec3 *p_stage_m, int count,
		       struct projection *out, bool *in_sight);

/* The derivative of a pixel's coordinate by a turn of the camera about its centre, stage axes,
 * 1/rad, from the slopes of that coordinate: it sees p where it saw p - turn x (p - centre). */
void view_turn(const struct view *view, struct vec3 p_stage_m, const double slopes[3],
	       double turn[3]);

/* Fetches what the ray through a pixel will ask for: of a place where nobody looked before. */
void view_expect_ray(const struct view *view, const double pixel[2]);

/* Unit vector of the ray through a pixel, stage axes; it starts at centre_stage_m. */
struct vec3 view_ray(const struct view *view, const double pixel[2]);
